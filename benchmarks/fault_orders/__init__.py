"""Names of faults from the orders of the bearing, without recordings of faults."""
