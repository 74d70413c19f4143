"""Plots that every page uses."""
