"""Filter of what the window system sends to the windows of the program."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Slot
from PySide6.QtGui import QGuiApplication, QWindow
from PySide6.QtWidgets import QWidget

__all__ = ["WindowFilter", "widget_of"]


class WindowFilter(QObject):
    """Base of filters for keys and wheel: ``eventFilter`` is called for events of all windows.

    A filter of the application would see every event of every object: a page that opens makes
    thousands, and Python would be called for each while STOP waits.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        application = cast(QGuiApplication | None, QCoreApplication.instance())
        if application is not None:
            application.focusWindowChanged.connect(self._watch)
        self._watch()

    @Slot()
    def _watch(self) -> None:
        """Look at all windows that there are; a dialog gets the focus once it is shown."""
        for window in QGuiApplication.topLevelWindows():
            window.installEventFilter(self)  # a second time changes nothing

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        raise NotImplementedError


def widget_of(window: QObject) -> QWidget | None:
    """Return the widget whose window of the system is ``window``."""
    return QWidget.find(cast(QWindow, window).winId())
