"""What happened once in a recording, and what comes with each run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from dearig.analysis.outcomes import Comparison, Evaluation
from dearig.model.diagnosis.events import OneTimeEvent, Own, drifts_at_rest, own_of
from dearig.model.effects import EFFECTS
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator

if TYPE_CHECKING:
    from dearig.analysis.readings.record import Readings
    from dearig.model.diagnosis.results import Diagnosis, Stage

__all__ = ["of_each_run", "own_of_each", "recurring_events", "with_events", "without_own"]

_SAME_MOMENT = 0.02  # s: times of events are stated to a hundredth


def of_each_run(events: Mapping[str, Sequence[OneTimeEvent]]) -> tuple[OneTimeEvent, ...]:
    """Return the events, by recording, that all of several have at the same moment of their run.

    Such an event comes with each run. Of those alike, the one with the earliest time is returned.
    """
    every = ((e.kind, e.time, name, e) for name, some in events.items() for e in some)
    found = sorted(every, key=lambda one: one[:3])
    groups: list[list[tuple[str, float, str, OneTimeEvent]]] = []
    for event in found:
        last = groups[-1][-1] if groups else ("", -math.inf)
        if event[0] == last[0] and event[1] - last[1] < _SAME_MOMENT:
            groups[-1].append(event)
        else:
            groups.append([event])
    alike = (g for g in groups if len({name for _, _, name, _ in g}) == len(events) > 1)
    return tuple(group[0][3] for group in alike)


def own_of_each(readings: Sequence[Readings], model: Any, may_drift: bool) -> dict[str, Own | None]:
    """Return the events and the drift of each of ``readings``; None without any, and of films."""
    records = {each.name: each.record for each in readings}
    rigs = [r for r in records.values() if isinstance(r, ActuatorRecord)]
    # of all recordings together: what is slow in each, and begins with its voltage, is a law
    may_drift = may_drift and isinstance(model, Actuator) and drifts_at_rest(rigs, model)

    def of(name: str) -> Own | None:
        record = records[name]
        if not (isinstance(record, ActuatorRecord) and isinstance(model, Actuator)):
            return None
        others = [r for other, r in records.items() if other != name]
        return own_of(record, model, may_drift=may_drift, others=others)

    return {name: of(name) for name in records}


def recurring_events(own: dict[str, Own | None], finding: Diagnosis) -> tuple[OneTimeEvent, ...]:
    """Return the events of the final model that come with each run, as it has them."""
    events = {name: () if found is None else found.events for name, found in own.items()}
    alike, known = {e.kind: e for e in of_each_run(events)}, dict(finding.final.model.effects)
    recurring = []
    for kind, event in alike.items():
        if kind in known:
            size, moment = (dict(known[kind])[p.name] for p in EFFECTS[kind].parameters)
            recurring.append(replace(event, time=moment, size=size))
    return tuple(recurring)


def with_events(final: Stage, recurring: Sequence[OneTimeEvent]) -> Stage:
    """Return ``final`` with the events that come with each run in what it predicts."""
    kinds = {event.kind for event in recurring}
    kept = tuple(e for e in final.model.effects if e[0] in kinds or EFFECTS[e[0]].is_reproducible)
    return replace(final, for_others=replace(final.model, effects=kept))


def without_own(stand: Evaluation, own: dict[str, Own | None]) -> Evaluation:
    """Return ``stand`` with each recording's events, and what they leave of untouched ones."""

    def of(comparison: Comparison) -> Comparison:
        found = own[comparison.name]
        if found is None:
            return comparison
        # the model of a training recording contains its events already
        left = found.rms if comparison.role == "validation" else None
        return replace(comparison, events=found.events, rms_without_events=left)

    return replace(
        stand, train=tuple(map(of, stand.train)), validation=tuple(map(of, stand.validation))
    )
