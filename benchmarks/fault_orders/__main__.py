"""Run the benchmark of names by orders."""

from benchmarks.fault_orders.command import main

if __name__ == "__main__":
    main()
