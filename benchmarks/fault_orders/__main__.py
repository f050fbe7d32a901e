"""Run the benchmark of names by orders, with spectra (joint), or over runs to failure (runs)."""

import sys

from benchmarks.fault_orders import command, joint, runs

if __name__ == "__main__":
    other = {"joint": joint.main, "runs": runs.main}.get("".join(sys.argv[1:2]))
    if other is None:
        command.main()
    else:
        other(sys.argv[2:])
