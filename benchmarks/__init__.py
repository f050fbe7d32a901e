"""Measurements behind the figures in the documentation; each folder answers one question."""
