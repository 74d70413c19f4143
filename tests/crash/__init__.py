"""Crashes replayed: ``python -m tests.crash replay`` and ``python -m tests.crash kills``."""
