"""Run the benchmark of names by orders, or that of names by spectra and orders together."""

import sys

from benchmarks.fault_orders import command, joint

if __name__ == "__main__":
    if sys.argv[1:2] == ["joint"]:
        joint.main(sys.argv[2:])
    else:
        command.main()
