"""What the computer was doing while a benchmark ran."""

from __future__ import annotations

import os

__all__ = ["cores_and_load"]


def cores_and_load() -> str:
    """Return the number of cores, and the load of the last minute where the system tells it."""
    cores = f"{os.cpu_count()} cores"
    return f"{cores}, load {os.getloadavg()[0]:.0f}" if hasattr(os, "getloadavg") else cores
