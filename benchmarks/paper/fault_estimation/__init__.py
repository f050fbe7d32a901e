"""Fault estimates against the known fault signal of the simulated rig."""
