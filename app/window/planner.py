"""Plan of the session's sequence, made again in the background after every change."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Slot

from dearig.acquisition.plan import Plan, plan
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.drivers.gate import Limits
from dearig.errors import InputError
from dearig.window.background import Background
from dearig.window.session import Breach, Preview, Session
from dearig.window.traces import Pyramid

__all__ = ["Planner", "make_preview"]

_BREACHES_MAX = 50  # time spans marked in one plot; more are drawn as one


class Planner(QObject):
    """Keeps ``session.preview`` up to date with the sequence, the rig file and the film."""

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._background = Background(self)
        self._background.done.connect(self._done)
        session.sequence_changed.connect(self.renew)
        session.rig_changed.connect(self.renew)

    @Slot()
    def renew(self) -> None:
        """Make the plan again."""
        s = self._session
        s.preview = None
        toml, folder, rig_file, film = s.sequence_toml, s.sequence_folder, s.rig_file, s.film
        self._background.start(lambda: make_preview(toml, folder, rig_file, film))

    def close(self) -> None:
        """Wait for the thread."""
        self._background.close()

    @Slot(object)
    def _done(self, preview: Preview) -> None:
        self._session.set_preview(preview)


def make_preview(toml: str, folder: Path, rig_file: RigFile, film: str = "") -> Preview:
    """Plan the sequence ``toml``; a fault in it becomes ``Preview.sentence``."""
    try:
        loaded = parse_sequence(toml, "the sequence", folder)
    except InputError as error:
        return Preview(toml, sentence=str(error))
    try:
        planned = plan(loaded, rig_file, film=film)
    except InputError as error:
        return Preview(toml, loaded, sentence=str(error))
    return Preview(
        toml,
        loaded,
        planned,
        curves={
            name: _thinned(getattr(planned, name), planned.rate)
            for name in ("voltage", "displacement", "field")
        },
        breaches=_breaches(planned, rig_file.gate_limits()),
        segments=_segments(loaded, float(planned.time[-1])),
    )


def _thinned(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    pyramid = Pyramid(values.size)
    pyramid.push(values)
    samples, extremes = pyramid.view(0, values.size)
    return samples / rate, extremes


def _segments(loaded: LoadedSequence, end: float) -> tuple[tuple[str, float, float], ...]:
    sequence = loaded.sequence
    at, found = sequence.lead_in, [("lead-in", 0.0, sequence.lead_in)]
    many = len(sequence.segments)
    for i, segment in enumerate(sequence.segments):
        found.append((f"{sequence.labels[i]} ({i + 1} of {many})", at, at + segment.duration))
        at += segment.duration
    return (*found, ("tail", at, end))


def _breaches(planned: Plan, limits: Limits) -> tuple[Breach, ...]:
    """Return the time spans in which an instantaneous limit of the gate is exceeded."""
    volts, rate = planned.voltage, planned.rate
    slew = np.abs(np.diff(volts, append=volts[-1:])) * rate
    broken = {
        "voltage": (volts > limits.voltage_max) | (volts < limits.voltage_min),
        "slew": slew > limits.slew,
        "true field": planned.field > limits.field,  # NaN, an unknown field, is not marked
    }
    found: list[Breach] = []
    for quantity, where in broken.items():
        edges = np.flatnonzero(np.diff(np.concatenate(([False], where, [False]))))
        starts, ends = edges[::2], edges[1::2]
        if starts.size > _BREACHES_MAX:
            starts, ends = starts[:1], ends[-1:]
        found += [
            Breach(quantity, float(a / rate), float(b / rate))
            for a, b in zip(starts, ends, strict=True)
        ]
    return tuple(found)
