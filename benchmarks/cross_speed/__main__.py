"""``python -m benchmarks.cross_speed``."""

from benchmarks.cross_speed.command import main

if __name__ == "__main__":
    main()
