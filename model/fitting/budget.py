"""Uncertainty budget of a fit: what the uncertainty of each given value does to the parameters.

Film, load and scalings are given, not fitted, and an error of theirs changes the parameters by
more than noise does: 1 % of thickness moves mu_0 by 1.6 %. Each is moved by one standard
uncertainty up and down, and the parameters are fitted again from where they are. Half the
difference is the shift. Shifts of independent values add up as squares.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dearig.model.errors import ModelError
from dearig.model.fitting.identify import Identification, coarse_problem
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import (
    Constraint,
    Contribution,
    Estimate,
    FitLayout,
    GivenValue,
)
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import Progress
from dearig.model.readings.records import ActuatorRecord, Record
from dearig.model.simulation.actuator import Actuator

__all__ = ["uncertainty_budget", "with_budget", "with_systematic"]

_GAIN = 1e-3  # of chi-square: both refits end at a hundredth of a standard deviation
_ITERATIONS = 40  # of a refit at most: it starts at an optimum one deviation away


def with_budget(
    records: Sequence[Record],
    fitted: Identification,
    given: Sequence[GivenValue],
    workers: int = 2,
    progress: Progress = lambda *_: None,
    stop: Callable[[], bool] = lambda: False,
) -> Identification:
    """Return ``fitted`` with the ``systematic`` uncertainty of each estimate; of actuators only.

    ``records`` are its training records. Without, where ``stop()`` is True before the end.
    """
    model = fitted.model
    if not isinstance(model, Actuator) or not given:
        return fitted
    held = np.isin(FitLayout(model).names, fitted.held_limits)
    found = uncertainty_budget(
        records, model, held, given, workers, progress, stop, fitted.constraints
    )
    return replace(fitted, estimates=with_systematic(fitted.estimates, found), budget=found)


def uncertainty_budget(
    records: Sequence[Record],
    model: Actuator,
    held: np.ndarray,
    given: Sequence[GivenValue],
    workers: int = 2,
    progress: Progress = lambda *_: None,
    stop: Callable[[], bool] = lambda: False,
    constraints: Sequence[Constraint] = (),
) -> tuple[Contribution, ...]:
    """Return what one standard uncertainty of each ``given`` value does to the parameters.

    ``model`` is fitted to the ``records``, with its parameters ``held`` (d,) bool not fitted, and
    with ``constraints`` stated of parameters. A
    drift that it has is fitted to each record for itself. () where ``stop()`` is True before the
    end: a part of the contributions is not a budget.
    """
    problem = coarse_problem(Problem(records, FitLayout(model, constraints=constraints), workers))
    layout = problem.layout
    held = held | problem.own | layout.fixed
    start = descend(problem, layout.coordinates(layout.initial()), held, gain=_GAIN).x
    done, found = 0, []
    for one in given:
        ends = []
        for sign in (-1.0, 1.0):
            if stop():
                return ()
            moved, changed = _moved(problem.records, model, one.name, sign * one.relative)
            other = Problem(moved, FitLayout(changed, constraints=constraints), workers)
            x = descend(other, start, held, _ITERATIONS, _GAIN, damping=1e-4).x
            ends.append(layout.values(x))
            done += 1
            progress("uncertainty budget", done / (2 * len(given)))
        shifts = np.where(held, 0.0, 0.5 * (ends[1] - ends[0]))
        found.append(Contribution(one, layout.names, tuple(map(float, shifts))))
    return tuple(found)


def with_systematic(
    estimates: Sequence[Estimate], budget: Sequence[Contribution]
) -> tuple[Estimate, ...]:
    """Return ``estimates`` with the root sum of squares of each one's shifts by a ``budget``."""
    squares: dict[str, float] = {}
    for one in budget:
        for name, shift in zip(one.names, one.shifts, strict=True):
            squares[name] = squares.get(name, 0.0) + shift**2
    return tuple(replace(e, systematic=math.sqrt(squares.get(e.name, 0.0))) for e in estimates)


def _moved(
    records: Sequence[Record], model: Actuator, name: str, by: float
) -> tuple[list[Record], Actuator]:
    """Return records and model with the value ``name`` larger by the part ``by``."""
    factor = 1.0 + by
    if not math.isfinite(factor) or factor <= 0.0:
        raise ModelError(f"an uncertainty of {by:.3g} of the {name} leaves no value above 0")
    if name == "mass":
        return [*records], replace(model, load=replace(model.load, mass=model.load.mass * factor))
    if name not in ("voltage", "displacement"):
        value = getattr(model.film, name) * factor
        return [*records], replace(model, film=replace(model.film, **{name: value}))
    moved: list[Record] = []
    for record in records:
        if not isinstance(record, ActuatorRecord):
            raise ModelError("an uncertainty budget is made of records driven by voltage")
        if name == "voltage":
            drive = replace(record.drive, voltage=record.drive.voltage * factor)
            moved.append(replace(record, drive=drive))
        else:
            # the weights stay, so that only the readings move
            moved.append(replace(record, displacement=record.displacement * factor))
    return moved, model
