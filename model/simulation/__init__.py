"""Simulation of the actuator under voltage and of a strip under stretch."""
