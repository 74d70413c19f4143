"""Tools of a plot area: their actions, the bar with their buttons, and their menu."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QAction, QKeySequence, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QMenu, QSizePolicy, QToolButton, QWidget

from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel

__all__ = ["PlotTools"]

_READOUT_LEAST = 170  # px of the readout; buttons that leave it less are in the menu only


class PlotTools(QWidget):
    """Bar of buttons with a readout at its right; ``menu`` holds every tool with its key.

    The keys work while the plots or the bar have the focus. The first button opens the menu; a
    narrow bar shows fewer of the others.
    """

    def __init__(self, area: QWidget) -> None:
        super().__init__(area)
        make = _Maker(area)
        self.crosshair = make("Crosshair", "Read the curves at the pointer", "C", checkable=True)
        self.cursors = make(
            "Cursors", "Two cursors, to be dragged, and their difference", "D", checkable=True
        )
        self.box = make("Box zoom", "Drag a rectangle to zoom both axes", "B", checkable=True)
        self.time = make(
            "Time zoom", "Drag to zoom the horizontal axis; also the wheel", "T", checkable=True
        )
        self.auto = make("Auto range", "Show the whole of all curves; also a double click", "A")
        self.back = make("Last range", "Take back the last zoom or shift", "Backspace")
        self.follow = make("Follow the run", "Show the newest samples again", "End")
        self.left = make("Earlier", "Move by a quarter of the range", "Left")
        self.right = make("Later", "Move by a quarter of the range", "Right")
        self.closer = make("Zoom in", "Zoom the horizontal axis", "+", "=")
        self.wider = make("Zoom out", "Zoom the horizontal axis", "-")
        self.copy = make("Copy picture", "Copy the plots as a picture", "Ctrl+C")
        self.copy_data = make(
            "Copy visible data", "Copy the visible points of the curves, for a spreadsheet"
        )
        self.png = make("Save picture as PNG …", "Save the plots as a picture of pixels")
        self.svg = make("Save picture as SVG …", "Save the plots as a drawing of lines")
        self.csv_visible = make(
            "Save visible data as CSV …", "Save the visible points of the curves"
        )
        self.csv_all = make("Save all data as CSV …", "Save all points of the curves")
        self.crosshair.setChecked(True)
        self.back.setEnabled(False)
        self.follow.setVisible(False)

        self.menu = QMenu("Plot", self)
        self.menu.setToolTipsVisible(True)
        for part in (
            (self.crosshair, self.cursors),
            (self.box, self.time, self.closer, self.wider, self.left, self.right),
            (self.auto, self.back, self.follow),
            (self.copy, self.png, self.svg),
            (self.copy_data, self.csv_visible, self.csv_all),
        ):
            self.menu.addActions(list(part))
            self.menu.addSeparator()
        self.opener = _button()
        self.opener.setText("Plot")
        self.opener.setToolTip("All tools of the plots; also the right button of the mouse")
        self.opener.setMenu(self.menu)
        self.opener.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.readout = ElidedLabel()
        self.readout.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(SPACE // 2)
        row.addWidget(self.opener)
        # the last of them are hidden first where there is no room
        self.buttons: dict[QAction, QToolButton] = {}
        for action in (self.follow, self.auto, self.cursors, self.box, self.time, self.crosshair):
            button = self.buttons[action] = _button()
            button.setDefaultAction(action)
            row.addWidget(button)
        row.addWidget(self.readout, 1)
        self.buttons[self.follow].hide()

    def show_follow(self, shown: bool) -> None:
        """Offer to follow the run, or not."""
        self.follow.setVisible(shown)
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        self._fit()

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        return QSize(self.opener.sizeHint().width(), self.opener.sizeHint().height())

    def _fit(self) -> None:
        """Show the buttons for which there is room next to the readout."""
        left = self.width() - _READOUT_LEAST - self.opener.sizeHint().width() - SPACE // 2
        for action, button in self.buttons.items():
            wanted = action.isVisible()
            if wanted:
                left -= button.sizeHint().width() + SPACE // 2
            # to follow the run is offered however narrow the bar is
            button.setVisible(wanted and (left >= 0 or action is self.follow))
        layout = self.layout()
        if layout is not None:
            layout.activate()


class _Maker:
    """Makes actions of an area; their keys work while the focus is inside it."""

    def __init__(self, area: QWidget) -> None:
        self._area = area

    def __call__(self, text: str, tip: str, *keys: str, checkable: bool = False) -> QAction:
        action = QAction(text, self._area)
        action.setCheckable(checkable)
        if keys:
            action.setShortcuts([QKeySequence(key) for key in keys])
            action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            tip = f"{tip} ({QKeySequence(keys[0]).toString()})"
        action.setToolTip(tip)
        self._area.addAction(action)
        return action


def _button() -> QToolButton:
    made = QToolButton()
    made.setProperty("role", "tool")
    made.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
    return made
