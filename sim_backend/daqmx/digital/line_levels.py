"""Levels of the digital lines: which lines there are, and who puts which level on them."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import LINES
from dearig.sim_backend.daqmx.card.names import physical_names
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.wire import Wire

__all__ = ["LineLevels"]


class LineLevels:
    """Levels of the card's lines, at ``terminals`` and on the ``wire`` to the amplifier."""

    def __init__(self, state: CardState, terminals: Terminals, wire: Wire) -> None:
        self._state = state
        self._terminals = terminals
        self._wire = wire

    def lines_of(self, physical: str) -> list[str]:
        """Return the digital lines in ``physical``: ``Dev1/port0/line0:3``, or a whole port."""
        lines = []
        for name in physical_names(physical, self._state.name):
            found = [line for line in LINES if line == name or line.startswith(f"{name}/")]
            if not found:
                raise DaqmxError(
                    Code.UNKNOWN_CHANNEL, f"Physical Channel: {self._state.name}/{name}"
                )
            lines += found
        return lines

    def columns_of(self, physical: str) -> Sequence[str]:
        """Return the lines in ``physical``, those of a whole port from the highest down."""
        columns = []
        for name in physical_names(physical, self._state.name):
            lines = self.lines_of(f"{self._state.name}/{name}")
            columns += lines if "/" in name else lines[::-1]
        return columns

    def put(self, line: str, level: bool, now: float) -> None:
        """Set ``line`` at ``now`` s."""
        self._wire.follow(now)
        self._wire.set_line(line, level, now)
        generated = any(
            t.generation is not None and line in t.line_names for t in self._state.tasks.values()
        )
        if not generated:
            self._terminals.drive(line).set(now, level)

    def level(self, line: str) -> bool:
        """Return the level that the card puts on ``line``."""
        with self._state.present():
            return self._wire.levels[line]

    def is_free(self, line: str) -> bool:
        """Return True if no task puts a level on ``line``."""
        tasks = self._state.tasks.values()
        return not any(t.kind is Kind.DO and line in t.line_names for t in tasks)

    def forget(self, now: float) -> None:
        """Discard the past of the lines, which inputs have taken up to ``now`` s."""
        for line in self._terminals.lines.values():
            line.forget_before(now)
