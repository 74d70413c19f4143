"""Labels and tooltips show names as text, not as HTML."""

from __future__ import annotations

from pathlib import Path

from PySide6 import QtGui
from PySide6.QtCore import QSettings, Qt
from PySide6.QtWidgets import QAbstractItemView, QComboBox, QLabel, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.window.frame import MainWindow
from dearig.window.session import Session
from dearig.window.theme import LIGHT, prepare_plots
from tests.window.recordings import made

HOSTILE = "<img src=//host/x.png><b>bold</b>"


def is_html(text: str) -> bool:
    """Whether Qt would show ``text`` as HTML with a tag of ours in it."""
    return QtGui.Qt.mightBeRichText(text) and ("<img" in text or "<b>" in text)


def tips(widget: QWidget) -> list[str]:
    found = [widget.toolTip()]
    models = []
    if isinstance(widget, QAbstractItemView | QComboBox) and widget.model() is not None:
        models.append(widget.model())
    for model in models:
        for row in range(model.rowCount()):
            for column in range(20):  # an index beyond the last column has no data
                tip = model.index(row, column).data(Qt.ItemDataRole.ToolTipRole)
                found.append(str(tip or ""))
    return found


def test_hostile_names_are_shown_as_text_everywhere(tmp_path: Path, qtbot: QtBot) -> None:
    folder = tmp_path / "a" / "<img src=//host" / "x.png><b>bold<" / "b>"
    folder.mkdir(parents=True)
    made(folder, "run", operator=HOSTILE, film_id=HOSTILE, notes=HOSTILE)
    prepare_plots()
    settings = QSettings(str(tmp_path / "dearig.ini"), QSettings.Format.IniFormat)
    session = Session(folder, settings, theme=LIGHT)
    window = MainWindow(session)
    qtbot.addWidget(window)
    window.show()
    session.set_notes(HOSTILE, HOSTILE, HOSTILE)
    session.set_rig_file(folder / f"{'<b>'}.toml", "", RigFile())
    session.set_sequence(
        f'name = "{HOSTILE}"\n[[segment]]\nkind = "{HOSTILE}"\n', folder, folder / "<b>.toml"
    )
    session.message.emit(HOSTILE)
    for page in window.pages:
        window.show_page(page)
    qtbot.waitUntil(
        lambda: any("<b>bold" in str(tip) or "&lt;b&gt;" in str(tip)
                    for view in window.recordings_page.findChildren(QAbstractItemView)
                    for tip in tips(view)),
        timeout=60_000,
    )  # fmt: skip
    labels = [found for found in window.findChildren(QLabel) if found.text()]
    assert any("<b>" in found.text() for found in labels)
    for found in labels:
        if found.textFormat() != Qt.TextFormat.PlainText:
            assert not is_html(found.text()), found.text()
    for widget in window.findChildren(QWidget):
        for tip in tips(widget):
            assert not is_html(tip), (type(widget), tip)
    assert window.close()
