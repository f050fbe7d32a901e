"""Verdicts on another bearing than those of the training."""
