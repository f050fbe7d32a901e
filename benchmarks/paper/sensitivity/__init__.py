"""Effect of the choices that the paper leaves open on the accuracy."""
