"""Choices of earlier imports, kept in the settings for files of the same layout."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime

from PySide6.QtCore import QSettings

from dearig.window.imports.choice import ColumnChoice, units_of
from dearig.window.session.settings import kept_text

__all__ = ["ImportMemory", "Remembered"]

_GROUP = "imports"
#: Layouts that are kept; the one that was used longest ago goes first.
KEPT_MAX = 200
_TEXT_MAX = 2**16  # characters of one of them


@dataclass(frozen=True)
class Remembered:
    """Choices of the import of ``file``, at the ISO time ``at``.

    ``columns`` are by the place of the column in its table, from 0. Sizes of the specimen are not
    kept: those of the next one differ.
    """

    file: str
    columns: dict[int, ColumnChoice]
    names_line: int | None = None
    rate_Hz: float | None = None
    skip_bad_rows: bool = False
    kinematics: str = ""
    at: str = field(default="")


class ImportMemory:
    """Choices by the signature of a table."""

    def __init__(
        self, settings: QSettings, now: Callable[[], datetime] = lambda: datetime.now(UTC)
    ) -> None:
        self._settings, self._now = settings, now

    def recall(self, signature: str) -> Remembered | None:
        """Return what was chosen for tables with ``signature``; None if nothing was."""
        text = kept_text(self._settings, f"{_GROUP}/{signature}", most=_TEXT_MAX)
        return _remembered(text) if text else None

    def keep(self, signature: str, chosen: Remembered) -> None:
        """Keep ``chosen`` for tables with ``signature``."""
        stored = asdict(chosen) | {"at": self._now().isoformat(timespec="seconds")}
        self._settings.setValue(f"{_GROUP}/{signature}", json.dumps(stored))
        self._settings.beginGroup(_GROUP)
        known = self._settings.childKeys()
        self._settings.endGroup()
        if len(known) > KEPT_MAX:
            ages = {key: found.at if (found := self.recall(key)) else "" for key in known}
            for key in sorted(known, key=lambda key: ages[key])[: len(known) - KEPT_MAX]:
                self.forget(key)

    def forget(self, signature: str) -> None:
        """Forget what was chosen for tables with ``signature``."""
        self._settings.remove(f"{_GROUP}/{signature}")


def _remembered(text: str) -> Remembered | None:
    """Return the choices in ``text``; None if the settings hold something else."""
    try:
        stored = json.loads(text)
        columns = {int(place): _column(choice) for place, choice in stored["columns"].items()}
        line, rate = stored["names_line"], stored["rate_Hz"]
        return Remembered(
            str(stored["file"]),
            columns,
            None if line is None else int(line),
            None if rate is None else float(rate),
            stored["skip_bad_rows"] is True,
            str(stored["kinematics"]),
            str(stored["at"]),
        )
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


def _column(stored: dict[str, object]) -> ColumnChoice:
    quantity, unit = str(stored["quantity"]), str(stored["unit"])
    if quantity and unit not in units_of(quantity, raw=True):
        raise ValueError(f"{quantity} in {unit}")
    numbers = (stored["scale"], stored["offset"])
    scale, offset = (None if n is None else float(str(n)) for n in numbers)
    return ColumnChoice(quantity, unit, scale, offset)
