"""Faults at every write, lock and allocation of a short run: ``python -m tests.faults``."""
