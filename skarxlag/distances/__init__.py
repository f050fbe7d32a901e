"""Distances of a row from each condition, at the speed of the row."""
