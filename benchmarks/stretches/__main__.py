"""``python -m benchmarks.stretches``."""

from benchmarks.stretches.command import main

main()
