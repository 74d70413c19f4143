"""Plan of the session's sequence, made again in the background after every change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QObject, Signal, Slot

from dearig.acquisition.plan import plan
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, SequenceFault, read_sequence
from dearig.config.toml_input import parse_toml
from dearig.errors import InputError, Interrupted
from dearig.progress import Progress, quiet
from dearig.window.jobs.background import Background
from dearig.window.jobs.worker import Worker
from dearig.window.kit.fields import as_labelled
from dearig.window.run.traces import Pyramid
from dearig.window.sequence.limit_marks import RowPeaks, fields_beyond, rows_beyond
from dearig.window.sequence.outline import outline
from dearig.window.session.state import Breach, Preview, Session

__all__ = ["Planner", "make_preview"]

_PIECE = 1 << 16  # samples of the voltage that are computed at once
_BREACHES_MAX = 50  # time spans marked in one plot; more are drawn as one


class Planner(QObject):
    """Keeps ``session.preview`` up to date with the sequence, the rig file and the film.

    While the model is compiled, an outline by kernels that are not is made in another process. That
    takes seconds on a first start; until then the voltage alone is shown, which needs no kernel.
    A plan that is no longer wanted ends at its next piece. ``progressed`` carries the part of the
    present plan that is done, 0 to 1.
    """

    progressed = Signal(float)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._wanted = 0  # number of the newest plan
        self._held = False
        self._outlines = Worker(self)
        self._background = Background(self)
        self._background.done.connect(self._done)
        session.sequence_changed.connect(self.renew)
        session.rig_changed.connect(self.renew)

    @Slot()
    def renew(self) -> None:
        """Make the plan again."""
        s = self._session
        s.preview = None
        if self._held:
            self._outline()
            return
        toml, folder, rig_file, film = s.sequence_toml, s.sequence_folder, s.rig_file, s.film
        progress = self._next_plan()
        self._background.start(lambda: make_preview(toml, folder, rig_file, film, progress))

    def _next_plan(self) -> Progress:
        """Begin another plan; return what ends it where it is no longer wanted."""
        self._wanted = number = self._wanted + 1

        def progress(stage: str, part: float) -> None:  # noqa: ARG001
            if number != self._wanted:
                raise Interrupted("another plan is asked for")
            self.progressed.emit(part)

        return progress

    @Slot(bool)
    def hold(self, held: bool) -> None:
        """Make no plans while the model is being compiled; afterwards make the newest."""
        if held != self._held:
            self._held = held
            if not held:
                self._outlines.close()
                self._session.set_outline(None)
            self.renew()

    def close(self) -> None:
        """End the plan, and wait for the thread."""
        self._wanted += 1
        self._outlines.close()
        self._background.close()

    def _outline(self) -> None:
        s = self._session
        toml, folder, rig_file = s.sequence_toml, s.sequence_folder, s.rig_file
        progress, number = self._next_plan(), self._wanted
        s.set_outline(None)  # it was that of another sequence
        self._background.start(lambda: outline_voltage(toml, folder, rig_file, progress))
        self._outlines.clear()
        self._outline_job = job = self._outlines.submit(
            outline, s.sequence_toml, str(s.sequence_folder), s.rig_text
        )

        def take(found: Preview | None) -> None:
            if self._held and number == self._wanted and found is not None:
                s.set_outline(found)

        job.finished.connect(take)

    @Slot(object)
    def _done(self, preview: Preview | None) -> None:
        session = self._session
        if preview is None or preview.is_outline:
            # the other process may have been faster
            if self._held and preview is not None and session.outline is None:
                session.set_outline(preview)
        elif not self._held:  # one that was begun before is made again
            session.set_preview(preview)


def outline_voltage(
    toml: str, folder: Path, rig_file: RigFile, progress: Progress = quiet
) -> Preview | None:
    """Return the voltage of the sequence ``toml`` as an outline, without what the model predicts.

    None where it cannot be played at all.
    """
    rate, nothing = rig_file.card.conversion_rate_Hz, np.empty(0)
    loaded, faults = read_sequence(toml, "the sequence", folder)
    if loaded is None or faults or loaded.clock_faults(rate):
        return None
    samples = loaded.on_clock(rate)
    voltage = Pyramid(samples.samples)
    for start in range(0, samples.samples, _PIECE):
        progress("voltage", start / samples.samples)
        voltage.push(samples.window(start, min(start + _PIECE, samples.samples)))
    return Preview(
        toml,
        sentence=loaded.sequence.name,
        curves={"voltage": _curve(voltage, rate)}
        | dict.fromkeys(("displacement", "field"), (nothing, nothing)),
        segments=_segments(loaded, (samples.samples - 1) / rate),
        is_outline=True,
    )


def make_preview(
    toml: str, folder: Path, rig_file: RigFile, film: str = "", progress: Progress = quiet
) -> Preview:
    """Plan the sequence ``toml``; all faults in it become ``Preview.faults``."""
    rate, limits = rig_file.card.conversion_rate_Hz, rig_file.gate_limits()
    try:
        loaded, faults = read_sequence(toml, "the sequence", folder)
    except InputError as error:
        return _refused(toml, None, [SequenceFault(str(error), str(error))])
    tables = _tables(toml)
    if loaded is not None:
        faults = loaded.clock_faults(rate)
    if faults or loaded is None:
        return _refused(toml, loaded, [*faults, *fields_beyond(tables, limits)])
    try:
        voltage = Pyramid(loaded.on_clock(rate).samples)
        high, low, steep = _Spans(), _Spans(), _Steep(rate, limits.slew)
        peaks = RowPeaks(loaded, rate)

        def observe(start: int, volts: np.ndarray) -> None:
            voltage.push(volts)
            high.take(start, volts > limits.voltage_max)
            low.take(start, volts < limits.voltage_min)
            steep.take(start, volts)
            peaks.take(start, volts)

        planned = plan(loaded, rig_file, film=film, progress=progress, observe=observe)
    except InputError as error:
        return _refused(toml, loaded, [SequenceFault(str(error), str(error))])
    beyond = [] if planned.waveform is not None else rows_beyond(loaded, planned, peaks, limits)
    voltages = {fault.row for fault in beyond if "voltage reaches" in fault.words}
    field = _Spans()
    field.take(0, planned.field > limits.field)  # NaN, an unknown field, is not marked
    steps = rate / planned.stride
    return Preview(
        toml,
        loaded,
        planned,
        curves={
            "voltage": _curve(voltage, rate),
            "displacement": _thinned(planned.displacement, steps),
            "field": _thinned(planned.field, steps),
        },
        breaches=(
            *high.breaches("voltage", rate),
            *low.breaches("voltage", rate),
            *steep.breaches("slew", rate),
            *field.breaches("true field", steps),
        ),
        segments=_segments(loaded, planned.duration),
        faults=(*beyond, *fields_beyond(tables, limits, {r for r in voltages if r is not None})),
    )


def _refused(toml: str, loaded: LoadedSequence | None, faults: list[SequenceFault]) -> Preview:
    """Return the preview of a sequence that cannot be planned."""
    many = [as_labelled(fault.sentence) for fault in faults]
    rest = f" (and {len(many) - 1} more)" if len(many) > 1 else ""
    return Preview(toml, loaded, sentence=many[0] + rest, faults=tuple(faults))


def _tables(toml: str) -> list[Mapping[str, Any]]:
    """Return the tables [[segment]] of a text that is TOML; what is none becomes an empty one."""
    found = parse_toml(toml, "the sequence").get("segment")
    tables = found if isinstance(found, list) else []
    return [table if isinstance(table, dict) else {} for table in tables]


def _thinned(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    pyramid = Pyramid(values.size)
    pyramid.push(values)
    return _curve(pyramid, rate)


def _curve(pyramid: Pyramid, rate: float) -> tuple[np.ndarray, np.ndarray]:
    samples, extremes = pyramid.view(0, pyramid.samples)
    return samples / rate, extremes


def _segments(loaded: LoadedSequence, end: float) -> tuple[tuple[str, float, float], ...]:
    sequence = loaded.sequence
    at, found = sequence.lead_in, [("lead-in", 0.0, sequence.lead_in)]
    many = len(sequence.segments)
    for i, segment in enumerate(sequence.segments):
        found.append((f"{sequence.labels[i]} ({i + 1} of {many})", at, at + segment.duration))
        at += segment.duration
    return (*found, ("tail", at, end))


class _Spans:
    """Spans of samples in which a limit is exceeded, found piece by piece."""

    def __init__(self) -> None:
        self._spans: list[tuple[int, int]] = []
        self._many = False  # more spans than can be marked: they become one

    def take(self, start: int, broken: np.ndarray) -> None:
        """Include ``broken`` (n,), which begins at sample ``start`` and continues the last one."""
        if not broken.any():
            return
        edges = np.flatnonzero(np.diff(np.concatenate(([False], broken, [False])))) + start
        for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if self._spans and (self._spans[-1][1] == first or self._many):
                self._spans[-1] = (self._spans[-1][0], last)
            else:
                self._spans.append((first, last))
            if len(self._spans) > _BREACHES_MAX:
                self._spans = [(self._spans[0][0], last)]
                self._many = True

    def breaches(self, quantity: str, rate: float) -> Iterator[Breach]:
        """Yield the spans of ``quantity`` at ``rate`` Hz."""
        for first, last in self._spans:
            yield Breach(quantity, first / rate, last / rate)


class _Steep(_Spans):
    """Spans in which the voltage changes faster than ``slew`` V/s; each begins before a step."""

    def __init__(self, rate: float, slew: float) -> None:
        super().__init__()
        self._rate, self._slew = rate, slew
        self._before = np.empty(0)

    def take(self, start: int, volts: np.ndarray) -> None:
        """Include the samples ``volts`` (n,) V from ``start`` on."""
        joined = np.concatenate((self._before, volts))
        self._before = volts[-1:].copy()
        steps = np.abs(np.diff(joined)) * self._rate
        super().take(start + volts.size - joined.size, steps > self._slew)
