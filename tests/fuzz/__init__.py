"""Damaged and hostile files for every reader: ``python -m tests.fuzz --inputs N --seconds S``."""
