"""Diagnose records: search for what the model lacks, and say how sure that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from dearig.model.diagnosis.conclusion import conclude
from dearig.model.diagnosis.engine import Search, SearchResult
from dearig.model.diagnosis.fits import Fit, Fitter
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.parameters import Constraint
from dearig.model.readings.records import ActuatorRecord, Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["diagnose"]

_LAST = 0.94  # of the progress: then come the final fits
_HELD_ITERATIONS = 20  # of fits that begin next to a fit to the same readings


def _quiet(stage: str, fraction: float) -> None:
    """Progress that no one watches."""


def _never() -> bool:
    return False


def _silent(line: str) -> None:
    """A log that no one reads."""


def diagnose(
    records: Sequence[Record],
    base: Actuator | Strip,
    *,
    workers: int = 2,
    progress: Callable[[str, float], None] = _quiet,
    stop: Callable[[], bool] = _never,
    thorough: bool = False,
    settings: DiagnosisSettings | None = None,
    log: Callable[[str], None] = _silent,
    others: Sequence[Record] = (),
    constraints: Sequence[Constraint] = (),
) -> Diagnosis:
    """Fit ``base`` to ``records``, find what it lacks, and put that in.

    ``records`` are all of actuators or all of films. ``progress(stage, fraction)`` is called often;
    when ``stop()`` is True, what was found until then is returned. The search ends after the work
    that the ``settings`` allow unless it is to be ``thorough``: that is counted in simulations, so
    the same records give the same answer on any machine. ``log`` receives a line on each choice.
    Of ``others``, records of the same sensor, only the readings at rest are used: they tell whether
    its noise is slow, which one lead-in of 2 s often does not. ``constraints`` are what is stated
    of parameters, of springs and of effects that may be found; they hold in every fit.
    Raises ``ModelError`` for records and models that do not fit together.
    """
    settings = settings or DiagnosisSettings()
    if thorough:
        settings = replace(settings, effort=math.inf)
    as_held = _with_held_voltage(records)
    part = _LAST / 2.0 if as_held else _LAST

    def searched(given: Sequence[Record], first: float) -> tuple[SearchResult, Search]:
        search = Search(
            Fitter(given, base, settings, workers, others=others, constraints=constraints),
            lambda stage, fraction: progress(stage, first + part * fraction),
            stop,
            log,
        )
        return search.run(), search

    progress("baseline", 0.0)
    found, search = searched(records, 0.0)
    held = False
    if as_held and found.status != "stopped" and _may_be_held(found, search, as_held):
        other, again = searched(as_held, part)
        found.judge.see([found.best, other.best])
        # what the records declare needs the odds that every other choice needs to be doubted
        held = _score(found, other.best) + search.settings.odds < _score(found, found.best)
        if held:
            found, search = other, again
    progress("final fits", _LAST)

    def ended() -> bool:
        return found.status == "stopped" or stop()

    diagnosis = conclude(found, search.fitter, search.without, held, ended)
    progress("final fits", 1.0)
    return diagnosis


def _with_held_voltage(records: Sequence[Record]) -> list[Record] | None:
    """Return ``records`` with a voltage that is held between samples; None where it is known.

    A table does not say what the voltage did between its rows. Half a sample too early, the model
    would be found to lack a lag of half a sample.
    """
    known = [r for r in records if isinstance(r, ActuatorRecord) and not r.drive.hold]
    if len(known) < len(records):
        return None
    return [
        replace(
            r,
            drive=replace(r.drive, hold=True),
            electric=None if r.electric is None else r.electric.held(),
        )
        for r in known
    ]


def _may_be_held(found: SearchResult, search: Search, as_held: Sequence[Record]) -> bool:
    """Whether a search with a held voltage is worth its time.

    It is where the first one leaves something, and where what it has found, or a part of it,
    explains as much with a held voltage: an effect may stand for the half sample.
    """
    best = found.best
    if not found.judge.is_settled(best):
        return True
    if best is found.baseline:
        return False
    known = search.fitter
    fitter = Fitter(
        as_held,
        found.baseline.model,
        search.settings,
        known.workers,
        others=known.others,
        constraints=known.constraints,
    )
    fitter.read_noise(found.baseline.model)
    for left_out in (None, *best.effects):
        effects = tuple(e for e in best.model.effects if e[0] != left_out)
        problem = fitter.problem(replace(best.model, effects=effects), best.drift)
        start = problem.layout.coordinates(problem.layout.initial())
        fit = fitter.refined(fitter.descend(problem, start, _HELD_ITERATIONS))
        if _score(found, fit) < _score(found, best):
            return True
    return False


def _score(found: SearchResult, fit: Fit) -> float:
    """Return the criterion of ``fit`` with the prior odds of its effects."""
    return found.judge.criterion(fit) + found.judge.settings.odds * len(fit.members)
