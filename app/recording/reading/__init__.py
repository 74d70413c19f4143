"""Recordings opened and read."""
