"""Suite of airspeed velocity, see the speed section of benchmarks/README.md."""
