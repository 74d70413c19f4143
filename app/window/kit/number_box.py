"""Fields of a number with arrows, whose text means the same in every language of the system.

Qt's own fields leave out a sign that is not the language's decimal one when they read a text: 0.5
typed on a German computer is 5. Here a text that is not a number, is ambiguous or outside the
limits is shown as it is typed and marked; when the field is left, the last number is shown again.
"""

from __future__ import annotations

import re

from PySide6.QtCore import QLocale, Slot
from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QDoubleSpinBox

from dearig.window.kit.number_text import NumberTextError, read_number
from dearig.window.kit.widgets import set_wrong

__all__ = ["NumberBox", "WholeBox"]

_TYPED = re.compile(r"[-+0-9.,'\u2019_ ]*")


class NumberBox(QDoubleSpinBox):
    """Takes a number from ``low`` to ``high``, with a decimal point or a decimal comma."""

    WHOLE = False  #: True where only whole numbers are taken

    def __init__(
        self, low: float, high: float, value: float, *, decimals: int, unit: str = ""
    ) -> None:
        super().__init__(minimum=low, maximum=high, decimals=decimals, value=value, suffix=unit)
        self.setLocale(QLocale.c())
        self.setCorrectionMode(QDoubleSpinBox.CorrectionMode.CorrectToPreviousValue)
        self.setKeyboardTracking(False)  # else the last number is that of half a text
        self.lineEdit().textChanged.connect(self._mark)
        self.editingFinished.connect(self._mark)

    def value(self) -> float:
        """Return the number that is shown; the last one where the text is not a number."""
        self.interpretText()
        self._mark()
        return super().value()

    def validate(self, text: str, at: int) -> tuple[QValidator.State, str, int]:
        if self._number(text) is not None:
            return QValidator.State.Acceptable, text, at
        # a key that is dropped would change the number
        typed = _TYPED.fullmatch(text.removesuffix(self.suffix()))
        return QValidator.State.Intermediate if typed else QValidator.State.Invalid, text, at

    def fixup(self, text: str) -> str:
        return text  # Qt would leave out what may be a decimal sign

    def valueFromText(self, text: str) -> float:  # noqa: N802
        number = self._number(text)
        return super().value() if number is None else number

    def _number(self, text: str) -> float | None:
        try:
            number = read_number(text.removesuffix(self.suffix()), self.WHOLE)
        except NumberTextError:
            return None
        taken = self.minimum() <= number <= self.maximum()
        return number if taken and not (self.WHOLE and number % 1) else None

    @Slot()
    def _mark(self) -> None:
        set_wrong(self, self._number(self.lineEdit().text()) is None)


class WholeBox(NumberBox):
    """Takes a whole number from ``low`` to ``high``."""

    WHOLE = True

    def __init__(self, low: int, high: int, value: int) -> None:
        super().__init__(low, high, value, decimals=0)

    def value(self) -> int:
        """Return the number that is shown; the last one where the text is not a whole number."""
        return int(super().value())
