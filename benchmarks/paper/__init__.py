"""The paper's experiments on the simulated rig."""
