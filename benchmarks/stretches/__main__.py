"""``python -m benchmarks.stretches``."""

from benchmarks.stretches.command import main

if __name__ == "__main__":
    main()
