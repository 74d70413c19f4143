"""Diagnose records: search for what the model lacks, and say how sure that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from dearig.model.actuator import Actuator
from dearig.model.diagnosis.conclusion import conclude
from dearig.model.diagnosis.engine import Search
from dearig.model.diagnosis.fits import Fitter
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.film import Strip
from dearig.model.records import Record

__all__ = ["diagnose_by_evidence"]


def _quiet(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


def _never() -> bool:
    return False


def _silent(line: str) -> None:
    """A log that nobody reads."""


def diagnose_by_evidence(
    records: Sequence[Record],
    base: Actuator | Strip,
    *,
    workers: int = 2,
    progress: Callable[[str, float], None] = _quiet,
    stop: Callable[[], bool] = _never,
    thorough: bool = False,
    settings: DiagnosisSettings | None = None,
    log: Callable[[str], None] = _silent,
) -> Diagnosis:
    """Fit ``base`` to ``records``, find what it lacks, and put that in.

    ``records`` are all of actuators or all of films. ``progress(stage, fraction)`` is called often;
    when ``stop()`` is True, what was found until then is returned. The search ends after the work
    that the ``settings`` allow unless it is to be ``thorough``: that is counted in simulations, so
    the same records give the same answer on any machine. ``log`` receives a line on each choice.
    Raises ``ModelError`` for records and models that do not fit together.
    """
    settings = settings or DiagnosisSettings()
    if thorough:
        settings = replace(settings, effort=math.inf)
    fitter = Fitter(records, base, settings, workers)
    search = Search(fitter, progress, stop, log)
    found = search.run()
    progress("final fits", 0.94)
    diagnosis = conclude(found, fitter, search.without)
    progress("final fits", 1.0)
    return diagnosis
