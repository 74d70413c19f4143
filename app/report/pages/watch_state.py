"""What a watcher shows of a campaign and of a recording: labels and units of channels, and JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from dearig.batch.watching import Seen, SourceWatch
from dearig.report.pages.campaign import campaign_json

__all__ = ["WatchedChannel", "in_order", "shown_channel", "watch_json"]


class WatchedChannel(NamedTuple):
    """How a channel is shown: ``factor`` makes values in ``unit`` of those in SI units.

    ``digits`` are those after the point, None for four significant ones.
    """

    label: str
    factor: float
    unit: str
    digits: int | None

    def text(self, value: float) -> str:
        """Return ``value``, in SI units, as text in ``unit``."""
        form = ".4g" if self.digits is None else f".{self.digits}f"
        return f"{value * self.factor:{form}}"


_CHANNELS = {
    "voltage_command": WatchedChannel("command", 1e-3, "kV", 3),
    "voltage_monitor": WatchedChannel("monitor", 1e-3, "kV", 3),
    "current_monitor": WatchedChannel("current", 1e3, "mA", 3),
    "displacement": WatchedChannel("displacement", 1e3, "mm", 4),
    "displacement_model": WatchedChannel("model", 1e3, "mm", 4),
    "temperature": WatchedChannel("temperature", 1.0, "\u00b0C", 2),
}


def shown_channel(name: str, described: Mapping[str, tuple[str, str]]) -> WatchedChannel:
    """Return how the channel ``name`` is shown; ``described`` has units and labels by name."""
    if name in _CHANNELS:
        return _CHANNELS[name]
    unit, label = described.get(name, ("", ""))
    return WatchedChannel(label or name.replace("_", " "), 1.0, "" if unit == "1" else unit, None)


def in_order(state: Seen) -> list[str]:
    """Return the channels that have values, those that every rig has first."""
    return sorted(state.now, key=lambda name: (name not in _CHANNELS, _place(name), name))


def _place(name: str) -> int:
    return list(_CHANNELS).index(name) if name in _CHANNELS else 0


def watch_json(watch: SourceWatch) -> dict[str, Any]:
    """Return what ``watch`` saw for ``--json``, in SI units."""
    state, outcome = watch.recording, watch.outcome
    return {
        "format": "dearig-watch/1",
        "campaign": None if outcome is None else campaign_json(outcome),
        "recording": None if state is None else {
            "path": str(state.path),
            "simulated": state.simulated,
            "samples": state.samples,
            "time_s": state.time,
            "duration_s": state.duration or None,
            "ended": state.ended,
            "outcome": state.outcome or None,
            "age_s": state.age,
            "live": state.live,
            "now": state.now,
            "peak": state.peak,
            "events": [
                {"time_s": e.time, "level": e.level, "message": e.message} for e in state.events
            ],
            "trouble": state.trouble,
        },
    }  # fmt: skip
