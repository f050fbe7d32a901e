"""How many small errors in modules the tests would notice."""
