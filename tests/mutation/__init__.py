"""How many small errors in the kernels the tests would notice."""
