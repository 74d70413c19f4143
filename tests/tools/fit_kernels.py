"""Compile the kernels of fits and of runs at once: halves of what both need, then the rest."""

import numpy as np

from dearig.model import kernel
from dearig.model.compiled.by_name import compile_some
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.kernel.drive import LOG
from dearig.model.kernel.lanes import carry_in_lanes
from dearig.model.simulation.actuator import NO_AIR, Actuator, Drive, readings_of

__all__ = ["compile_fit_kernels", "compile_some"]


def compile_fit_kernels() -> None:
    """Call the kernels of populations and of derivatives once."""
    cs = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3).coefficients()[None]
    drive = Drive(np.array([0.0, 0.01]), np.zeros(2))
    readings_of(cs, THESIS_FILM.length, drive, fidelity=kernel.COARSE)
    log = np.zeros((2, LOG))
    log[0, 0] = 1  # step
    carry_in_lanes(
        cs, drive.time, drive.voltage, drive.ends, NO_AIR, log, np.zeros((1, 2)), np.zeros((1, 2))
    )
