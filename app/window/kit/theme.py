"""Theme of the window: colours for all kinds of colour vision, light and dark, and large digits.

The hues are those of Okabe and Ito; on a light ground the pale ones are darkened so that thin lines
are visible. A shape or a word repeats what a colour says.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFont, QFontDatabase, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication

__all__ = [
    "DARK",
    "LIGHT",
    "SPACE",
    "Theme",
    "apply",
    "digits",
    "pen",
    "prepare_plots",
    "system_theme",
]

SPACE = 8  #: px between widgets
_ICONS = Path(__file__).with_name("icons")


@dataclass(frozen=True)
class Theme:
    """Colours by their use, as ``#rrggbb``."""

    dark: bool
    window: str
    surface: str
    raised: str
    text: str
    muted: str
    line: str
    accent: str
    on_accent: str
    command: str
    monitor: str
    measured: str
    models: tuple[str, str]
    field: str
    limit: str
    good: str
    warn: str
    bad: str

    @property
    def curves(self) -> tuple[str, ...]:
        """Colours for several curves in one plot."""
        return (self.command, *self.models, self.monitor, self.field, self.measured)


LIGHT = Theme(
    dark=False,
    window="#f3f4f6",
    surface="#ffffff",
    raised="#e7e9ed",
    text="#16181d",
    muted="#5a6170",
    line="#c9ced8",
    accent="#0072b2",
    on_accent="#ffffff",
    command="#0072b2",
    monitor="#c98300",
    measured="#16181d",
    models=("#d55e00", "#00825f"),
    field="#a8508a",
    limit="#a8508a",
    good="#00785a",
    warn="#8f6000",
    bad="#b83a00",
)

DARK = Theme(
    dark=True,
    window="#15171b",
    surface="#1c1f25",
    raised="#2a2e37",
    text="#eceef2",
    muted="#a2a9b8",
    line="#3d434f",
    accent="#56b4e9",
    on_accent="#0b0d10",
    command="#56b4e9",
    monitor="#e69f00",
    measured="#f4f5f7",
    models=("#ff8a3d", "#2fcf9f"),
    field="#cc79a7",
    limit="#e39bc3",
    good="#2fcf9f",
    warn="#f0b429",
    bad="#ff8a5c",
)


def system_theme() -> Theme:
    """Return the theme of the system; the light one if it is unknown."""
    dark = QGuiApplication.styleHints().colorScheme() == Qt.ColorScheme.Dark
    return DARK if dark else LIGHT


def prepare_plots() -> None:
    """Configure pyqtgraph before the first plot: without antialiasing, which costs frames."""
    pg.setConfigOptions(antialias=False, useOpenGL=False)


def apply(application: QApplication, theme: Theme) -> None:
    """Use ``theme`` for the whole application."""
    # a style makes Qt restyle all widgets, even where it is the one that is used
    if not application.styleSheet() and application.style().name() != "fusion":
        application.setStyle("Fusion")
    palette = QPalette()
    roles = QPalette.ColorRole
    for role, colour in (
        (roles.Window, theme.window),
        (roles.WindowText, theme.text),
        (roles.Base, theme.surface),
        (roles.AlternateBase, theme.raised),
        (roles.Text, theme.text),
        (roles.PlaceholderText, theme.muted),
        (roles.Button, theme.raised),
        (roles.ButtonText, theme.text),
        (roles.BrightText, theme.bad),
        (roles.ToolTipBase, theme.surface),
        (roles.ToolTipText, theme.text),
        (roles.Highlight, theme.accent),
        (roles.HighlightedText, theme.on_accent),
        (roles.Link, theme.accent),
        (roles.Light, theme.raised),
        (roles.Mid, theme.line),
        (roles.Dark, theme.line),
    ):
        palette.setColor(role, QColor(colour))
    for role in (roles.Text, roles.ButtonText, roles.WindowText):
        palette.setColor(QPalette.ColorGroup.Disabled, role, QColor(theme.muted))
    sheet = _sheet(theme)
    if application.styleSheet() != sheet:  # a new style sheet makes Qt restyle all widgets
        application.setPalette(palette)
        application.setStyleSheet(sheet)


def _sheet(t: Theme) -> str:
    tick = (_ICONS / f"tick-{'dark' if t.dark else 'light'}.png").as_posix()
    return f"""
    QToolTip {{ color: {t.text}; background: {t.surface}; border: 1px solid {t.line}; }}
    QLabel[role="title"] {{ font-size: 15pt; font-weight: 600; }}
    QLabel[role="heading"] {{ font-weight: 600; }}
    QLabel[role="muted"] {{ color: {t.muted}; }}
    QLabel[role="good"] {{ color: {t.good}; }}
    QLabel[role="warn"] {{ color: {t.warn}; }}
    QLabel[role="bad"] {{ color: {t.bad}; font-weight: 600; }}
    QFrame[role="card"] {{
        background: {t.surface}; border: 1px solid {t.line}; border-radius: 6px;
    }}
    QFrame[role="bar"] {{ background: {t.surface}; border-bottom: 1px solid {t.line}; }}
    QFrame[role="banner"] {{
        background: {t.surface}; border: 2px solid {t.warn}; border-radius: 4px;
    }}
    QPushButton {{
        padding: 5px 12px; border: 1px solid {t.line}; border-radius: 4px; background: {t.raised};
    }}
    QPushButton:hover {{ border-color: {t.accent}; }}
    QPushButton:focus, QLineEdit:focus {{ border: 2px solid {t.accent}; }}
    QPushButton:disabled {{ color: {t.muted}; background: {t.window}; }}
    QPushButton[role="primary"] {{
        color: {t.on_accent}; background: {t.accent}; border-color: {t.accent}; font-weight: 600;
    }}
    QPushButton[role="primary"]:disabled {{
        color: {t.muted}; background: {t.window}; border-color: {t.line};
    }}
    QToolButton[role="tool"] {{
        padding: 1px 7px; border: 1px solid {t.line}; border-radius: 4px; background: {t.raised};
    }}
    QToolButton[role="tool"]:hover, QToolButton[role="tool"]:focus {{ border-color: {t.accent}; }}
    QToolButton[role="tool"]:checked {{ border-color: {t.accent}; background: {t.surface}; }}
    QToolButton[role="tool"]:disabled {{ color: {t.muted}; }}
    QToolButton[role="tool"]::menu-indicator {{ width: 9px; subcontrol-position: right center; }}
    QPushButton[role="switch"]:checked {{
        color: {t.on_accent}; background: {t.accent}; border-color: {t.accent};
    }}
    QLineEdit, QPlainTextEdit {{
        padding: 3px 5px; border: 1px solid {t.line}; border-radius: 4px; background: {t.surface};
        selection-background-color: {t.accent}; selection-color: {t.on_accent};
    }}
    QLineEdit[wrong="true"], QAbstractSpinBox[wrong="true"] {{ border: 2px solid {t.bad}; }}
    QRadioButton::indicator, QCheckBox::indicator, QAbstractItemView::indicator {{
        width: 12px; height: 12px; border: 1px solid {t.muted}; background: {t.surface};
    }}
    QRadioButton::indicator {{ border-radius: 7px; }}
    QCheckBox::indicator, QAbstractItemView::indicator {{ border-radius: 2px; }}
    QRadioButton::indicator:checked {{
        border-color: {t.accent};
        background: qradialgradient(cx:0.5, cy:0.5, radius:0.5, fx:0.5, fy:0.5,
            stop:0 {t.accent}, stop:0.55 {t.accent}, stop:0.65 {t.surface}, stop:1 {t.surface});
    }}
    QCheckBox::indicator:checked, QAbstractItemView::indicator:checked {{
        border-color: {t.accent}; background: {t.accent}; image: url("{tick}");
    }}
    QRadioButton::indicator:focus, QCheckBox::indicator:focus {{ border: 2px solid {t.accent}; }}
    QTabWidget::pane {{ border: 1px solid {t.line}; }}
    QListWidget#pages {{ border: none; background: {t.raised}; outline: none; font-size: 11pt; }}
    QListWidget#pages::item {{ padding: 10px 12px; }}
    QListWidget#pages::item:selected {{ color: {t.on_accent}; background: {t.accent}; }}
    """


def digits(points: int) -> QFont:
    """Return a bold font of fixed width, so that digits keep their places."""
    font = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
    font.setPointSize(points)
    font.setBold(True)
    return font


def pen(colour: str, dashed: bool = False) -> object:
    """Make a pen one pixel wide; wider ones are drawn twenty times as slowly."""
    style = Qt.PenStyle.DashLine if dashed else Qt.PenStyle.SolidLine
    return pg.mkPen(QColor(colour), width=1, style=style)
