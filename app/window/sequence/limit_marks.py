"""Rows and fields of a sequence that exceed a limit of the rig file, each with its own words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from dearig.acquisition.plan import Plan
from dearig.config.sequencefile import LoadedSequence, SequenceFault
from dearig.drivers.gate import Limits

__all__ = ["RowPeaks", "fields_beyond", "rows_beyond"]

_KV = 1e3  # V


class RowPeaks:
    """Highest and lowest voltage in V and highest slew in V/s of each segment as it is played.

    ``take`` gets the samples at ``rate`` Hz piece by piece. A step belongs to the segment of its
    later sample.
    """

    def __init__(self, loaded: LoadedSequence, rate: float) -> None:
        self._rate = rate
        self._edges = _edges(loaded, rate)
        count = self._edges.size - 1
        self.high, self.low = np.full(count, -np.inf), np.full(count, np.inf)
        self.slew = np.zeros(count)
        self._before: float | None = None

    def take(self, start: int, volts: np.ndarray) -> None:
        """Include the samples ``volts`` (n,) V from ``start`` on."""
        steps = np.abs(np.diff(volts, prepend=volts[0] if self._before is None else self._before))
        self._before = float(volts[-1])
        for i, first, last in _pieces(self._edges, start, volts.size):
            self.high[i] = max(self.high[i], volts[first:last].max())
            self.low[i] = min(self.low[i], volts[first:last].min())
            self.slew[i] = max(self.slew[i], steps[first:last].max() * self._rate)


def rows_beyond(
    loaded: LoadedSequence, planned: Plan, peaks: RowPeaks, limits: Limits
) -> list[SequenceFault]:
    """Return a fault for each row whose voltage, slew or predicted field exceeds its limit."""
    rate = planned.rate / planned.stride
    edges = _edges(loaded, rate)
    field = np.zeros(edges.size - 1)
    for i, first, last in _pieces(edges, 0, planned.field.size):
        # NaN is an unknown field, after the model failed or a limit was exceeded
        field[i] = np.nanmax(np.nan_to_num(planned.field[first:last]), initial=0.0)
    said: dict[int, list[str]] = {}
    for i, row in enumerate(loaded.rows):
        for quantity, value, allowed, unit, scale in (
            ("voltage", peaks.high[i], limits.voltage_max, "kV", 1e-3),
            ("negative voltage", -peaks.low[i], -limits.voltage_min, "kV", 1e-3),
            ("slew", peaks.slew[i], limits.slew, "kV/s", 1e-3),
            ("true field", field[i], limits.field, "MV/m", 1e-6),
        ):
            if np.isfinite(value) and value > allowed:
                words = (
                    f"{quantity} reaches {value * scale + 0.0:.6g} {unit}, "
                    f"{allowed * scale + 0.0:.6g} {unit} is allowed"
                )
                if words not in said.setdefault(row, []):
                    said[row].append(words)
    kinds = dict(zip(loaded.rows, loaded.sequence.labels, strict=True))
    return [
        SequenceFault(
            f"segment {row + 1} ({kinds[row]}): {'; '.join(words)}", "; ".join(words), row
        )
        for row, words in said.items()
    ]


def fields_beyond(
    segments: list[Mapping[str, Any]], limits: Limits, rows: set[int] | None = None
) -> list[SequenceFault]:
    """Return a fault for each field in kV that alone exceeds the voltage limits.

    ``rows``: those that exceed a voltage limit as they are played; None where that is not known.
    A row of those in which no field alone exceeds a limit has a fault for each field in kV.
    """
    found: list[SequenceFault] = []
    for row, table in enumerate(segments):
        if rows is not None and row not in rows:
            continue
        voltages = {key: value for key, value in table.items() if key.endswith("_kV")}
        where = f"segment {row + 1} ({table.get('kind')})"
        alone = {
            key: words for key, value in voltages.items() if (words := _words(value, limits))
        }  # fmt: skip
        if rows is not None and not alone:
            alone = dict.fromkeys(
                voltages, "with the other fields of this segment, beyond the voltage limits"
            )
        found += [
            SequenceFault(f"{where}: {key}: {words}", words, row, key)
            for key, words in alone.items()
        ]
    return found


def _words(value: Any, limits: Limits) -> str:
    """Return why ``value`` in kV, a number or a list, exceeds the limits; "" where it does not."""
    low, high = limits.voltage_min / _KV, limits.voltage_max / _KV

    def beyond(part: Any) -> bool:
        # an amplitude swings to both sides: only what exceeds the limits with any offset counts
        number = isinstance(part, int | float) and not isinstance(part, bool)
        return number and part > high and 2.0 * part > high - low

    limit = f"{high:g} kV, the limit of the rig file"
    if not isinstance(value, list):
        return f"{value:g} kV is above {limit}" if beyond(value) else ""
    many = [f"value {i + 1} ({part:g} kV)" for i, part in enumerate(value) if beyond(part)]
    return f"{', '.join(many)} {'is' if len(many) == 1 else 'are'} above {limit}" if many else ""


def _edges(loaded: LoadedSequence, rate: float) -> np.ndarray:
    """Return the first sample of each segment at ``rate`` Hz, and the end of the last."""
    edges = np.ceil(loaded.sequence.boundaries * rate - 1e-6).astype(np.int64)
    edges[-1] += 1  # the last segment ends at 0 V with its last sample
    return edges


def _pieces(edges: np.ndarray, start: int, count: int) -> Iterator[tuple[int, int, int]]:
    """Yield each segment in ``count`` samples from ``start`` on, with its first and last + 1."""
    first = max(int(np.searchsorted(edges, start, side="right")) - 1, 0)
    for i in range(first, edges.size - 1):
        begin, end = int(edges[i]) - start, int(edges[i + 1]) - start
        if begin >= count:
            return
        if end > max(begin, 0):
            yield i, max(begin, 0), min(end, count)
