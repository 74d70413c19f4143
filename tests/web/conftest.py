"""Fixtures of campaigns."""

from tests.tools.played import bench, made_runs

__all__ = ["bench", "made_runs"]
