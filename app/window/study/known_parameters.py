"""Choice of a parameter file: what is known of parameters before a fit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from dearig.config.parameterfile import Stated, load_parameter_file
from dearig.errors import InputError
from dearig.report.text.numbers import symbol
from dearig.units import name_and_unit
from dearig.window.documents.dialogs import choose_file
from dearig.window.kit.widgets import ElidedLabel, Message, button
from dearig.window.session.state import Session

__all__ = ["KnownParameters"]

_TIP = (
    "Choose a parameter file (TOML) that says what is known of parameters: a prior by its mean and "
    "standard deviation, bounds, or a value that is not fitted"
)


class KnownParameters(QWidget):
    """Shows what a parameter file states. ``changed``: another one is chosen, or none."""

    changed = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.path: Path | None = None
        self.choose_button = button("&Known …", _TIP)
        self.choose_button.clicked.connect(self._ask)
        self.clear_button = button("None", "Fit all parameters without prior knowledge")
        self.clear_button.clicked.connect(self._clear)
        self.shown = ElidedLabel("muted")
        self.trouble = Message()
        row = QHBoxLayout()
        row.addWidget(self.choose_button)
        row.addWidget(self.shown, 1)
        row.addWidget(self.clear_button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(self.trouble)
        self._show({})

    def stated(self) -> Stated:
        """Return what the file states now, nothing without one. Raises ``InputError``."""
        return {} if self.path is None else load_parameter_file(self.path)

    def open_file(self, path: Path) -> None:
        """Use the parameter file ``path``; one that cannot be read changes nothing."""
        try:
            stated = load_parameter_file(path)
        except InputError as error:
            self.trouble.show_text(f"{error}. Nothing was changed.")
            return
        self.path = path
        self._show(stated)
        self.changed.emit()

    @Slot()
    def _clear(self) -> None:
        self.path = None
        self._show({})
        self.changed.emit()

    def _show(self, stated: Stated) -> None:
        self.trouble.show_text("")
        said = "; ".join(_text(name, table) for name, table in stated.items())
        self.shown.show_text(
            said or "no known parameters", f"{self.path}: {said}" if said else _TIP
        )
        self.clear_button.setVisible(self.path is not None)

    @Slot()
    def _ask(self) -> None:
        path = choose_file(
            self, self._session, "What is known of parameters", self._session.folder,
            "Parameter files (*.toml)",
        )  # fmt: skip
        if path is not None:
            self.open_file(path)


def _text(key: str, table: Mapping[str, float]) -> str:
    """Return what the ``table`` of a parameter states, as "μ₀ (kPa): 46 ± 0.5"."""
    name, unit = name_and_unit(key)
    parts = []
    if "fixed" in table:
        parts.append(f"{table['fixed']:g}, not fitted")
    if "mean" in table:
        parts.append(f"{table['mean']:g} ± {table['sd']:g}")
    ends = {"low": "from {:g}", "high": "up to {:g}"}
    parts += [text.format(table[end]) for end, text in ends.items() if end in table]
    shown = symbol(name.replace(" ", "_")).replace("_", " ").replace(".", ": ")
    return f"{shown} ({unit}): {', '.join(parts)}" if unit else f"{shown}: {', '.join(parts)}"
