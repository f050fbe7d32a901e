"""The monitor on runs to failure."""
