"""Run time, start-up and memory, next to peers."""
