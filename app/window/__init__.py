"""Operator's window."""
