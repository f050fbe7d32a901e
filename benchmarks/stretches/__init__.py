"""Accuracy on stretches of recordings across shaft speeds, with and without nominal speeds."""
