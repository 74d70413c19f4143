"""Recordings written, during a run and after it."""
