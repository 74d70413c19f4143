"""What identification and validation hand to the terminal, to JSON and to the report."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from model.fitting import Identification
from model.measures import Errors

__all__ = ["BranchTrial", "Comparison", "IdentifyOutcome", "Published", "ValidateOutcome"]


@dataclass(frozen=True)
class Published:
    """The thesis's own figures for one run, in per cent as printed."""

    e_rms_pct: float
    e_m_pct: float


@dataclass(frozen=True)
class Comparison:
    """One recording beside a model of it.

    ``kind`` is actuator (``drive`` in V, ``measured`` and ``model`` in m) or film (``drive`` is the
    stretch, the others in Pa); all arrays are (N,) on ``time`` s. ``noise`` is the noise floor in
    the measured unit, None where it could not be read. ``role`` is train or validation. ``table``
    is A, B, or "" for a run that is in neither of the thesis's validation tables, ``row`` its label
    there (f = 0.2 Hz).
    """

    name: str
    kind: str
    role: str
    time: np.ndarray
    drive: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    errors: Errors
    noise: float | None
    table: str = ""
    row: str = ""
    published: Published | None = None
    warnings: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class BranchTrial:
    """What one number of branches did: errors (Pa or m, and per cent of peak) pooled over files.

    ``bic`` is the information criterion on the training data, by which the number is chosen;
    validation plays no part in that choice.
    """

    branches: int
    train_rms: float
    train_peak_pct: float
    validation_rms: float | None
    validation_peak_pct: float | None
    bic: float
    chosen: bool


@dataclass(frozen=True)
class IdentifyOutcome:
    """A finished identification: the fit, the training runs beside it, and validation if any."""

    title: str
    kind: str
    method: str
    fit: Identification
    train: tuple[Comparison, ...]
    validation: tuple[Comparison, ...]
    trials: tuple[BranchTrial, ...]
    model_path: str
    seconds: float
    published_fit: Published | None = None


@dataclass(frozen=True)
class ValidateOutcome:
    """A finished validation: one comparison a recording."""

    title: str
    kind: str
    model_name: str
    model_path: str
    comparisons: tuple[Comparison, ...]
