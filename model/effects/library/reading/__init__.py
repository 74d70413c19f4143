"""Drift and interference of the reading."""
