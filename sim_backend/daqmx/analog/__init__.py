"""Analog inputs and outputs: one run of the simulated rig."""
