"""Files of diagnosers and of monitors' states."""
