"""Processes of their own, and their priority."""
