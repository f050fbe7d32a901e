"""``python -m benchmarks.monitoring``."""

from benchmarks.monitoring.runs_to_failure import main

if __name__ == "__main__":
    main()
