"""Fields of an import besides its columns: time, specimen, film and load."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFormLayout,
    QLabel,
    QLineEdit,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from dearig.config.imports import imported_metadata
from dearig.model.film.specimen import KINEMATICS
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.importers.columns.specimen import Specimen
from dearig.window.kit.number_text import NumberTextError, read_number
from dearig.window.kit.widgets import button, label, plain_tip, set_wrong
from dearig.window.session.state import Session

__all__ = ["ImportFields"]

_ASSUMED, _RIG_FILE, _GIVEN = "assumed", "rig", "given"
_SPECIMEN = (
    ("gauge_length_mm", "&Gauge length (mm)", "Length of the specimen at rest"),
    ("area_mm2", "Cross-&section (mm²)", "Cross-section of the specimen at rest"),
)
_FILM = (
    ("length_mm", "Film length (mm)", "Length of the film along the motion"),
    ("width_mm", "Film width (mm)", "Width of the film"),
    ("thickness_um", "Film thickness (µm)", "Thickness of the film before it is loaded"),
    ("permittivity", "Permittivity", "Relative permittivity of the film"),
    ("load_g", "Load (g)", "Mass that hangs on the film"),
)


class ImportFields(QWidget):
    """Fields of an import; ``changed`` is after each change."""

    changed = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._stated = Specimen()
        self._kind = ""
        self._there: frozenset[str] = frozenset()
        self._lines: dict[str, QLineEdit] = {}
        self.names_line = QSpinBox(minimum=0, maximum=100_000)
        self.names_line.setSpecialValueText("found automatically")
        self.names_line.setToolTip("Line of the names in a text file")
        self.skip = QCheckBox("Leave out &bad rows")
        self.skip.setToolTip(
            "Leave out rows that cannot be read or go back in time; they are counted, and are "
            "events of the recording"
        )
        self.skip.toggled.connect(self._changed)
        self.film = QComboBox()
        self.film.addItem("not known: fits assume the thesis's", _ASSUMED)
        named = session.rig_path.name if session.rig_path else "the defaults of a rig file"
        self.film.addItem(f"as in the rig file in use ({named})", _RIG_FILE)
        self.film.addItem("given here", _GIVEN)
        self.film.setToolTip(plain_tip(
            "Film and load of the data. With the rig file in use, its scalings apply to columns in "
            "V at the card"
        ))  # fmt: skip
        self.kinematics = QComboBox()
        self.kinematics.addItem("uniaxial for film data", "")
        for name in KINEMATICS:
            self.kinematics.addItem(name, name)
        self.kinematics.setToolTip("How the film was held")
        self.use_stated = button("", "Enter the sizes that the head of the file tells")
        self.use_stated.clicked.connect(self._take_stated)
        self.form = QFormLayout()
        self.form.addRow("Names in &line", self.names_line)
        self._add("rate_Hz", "&Rate (Hz)", "Sample rate, in place of a column for time")
        self.form.addRow(self.skip)
        for key, words, tip in _SPECIMEN:
            self._add(key, words, tip)
        self.form.addRow(self.use_stated)
        self.form.addRow("&Film and load", self.film)
        for key, words, tip in _FILM:
            self._add(key, words, tip)
        self.form.addRow("&Kinematics", self.kinematics)
        self.note = label("", "muted")
        self.note.setWordWrap(True)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addLayout(self.form)
        outer.addWidget(self.note)
        outer.addStretch(1)
        self.film.currentIndexChanged.connect(self._film_changed)
        self.kinematics.currentIndexChanged.connect(self._changed)
        self.show_kind("")

    def _add(self, key: str, words: str, tip: str) -> None:
        line = QLineEdit()
        line.setToolTip(tip)
        line.textEdited.connect(self._changed)
        self._lines[key] = line
        self.form.addRow(words, line)

    def line(self, key: str) -> QLineEdit:
        """Return the field of ``key``."""
        return self._lines[key]

    def show_kind(self, kind: str, there: Collection[str] = ()) -> None:
        """Show the fields that an import of ``kind`` (actuator, film, or "") has.

        ``there`` are the quantities that are chosen; a film's stretch needs no gauge length.
        """
        self._kind, self._there = kind, frozenset(there)
        given = kind == "actuator" and self.film.currentData() == _GIVEN
        length = kind == "film" and not self._there & {"stretch", "strain"}
        area = kind == "film" and "nominal_stress" not in self._there
        for key, needed in (("gauge_length_mm", length), ("area_mm2", area)):
            self.form.setRowVisible(self._lines[key], needed)
        stated = (length and self._stated.gauge_length_mm, area and self._stated.area_mm2)
        self.form.setRowVisible(self.use_stated, any(stated))
        self.form.setRowVisible(self.film, kind == "actuator")
        for key, _, _ in _FILM:
            self.form.setRowVisible(self._lines[key], given)
        self.form.setRowVisible(self.kinematics, kind != "")
        self.kinematics.setItemText(
            0, "uniaxial" if kind == "film" else "as the film says"
        )  # fmt: skip

    def show_stated(self, stated: Specimen, text: bool) -> None:
        """Offer the size ``stated`` by the file's head; ``text``: it has a line of names."""
        self._stated = stated
        parts = []
        if stated.gauge_length_mm is not None:
            parts.append(f"length {stated.gauge_length_mm:g} mm")
        if stated.area_mm2 is not None:
            parts.append(f"cross-section {stated.area_mm2:g} mm²")
        self.use_stated.setText(f"Use what the file says: {', '.join(parts)}")
        self.form.setRowVisible(self.names_line, text)
        self.show_kind(self._kind, self._there)

    @property
    def raw(self) -> bool:
        """True if the scalings of the rig file apply."""
        return bool(self.film.currentData() == _RIG_FILE)

    def numbers(self) -> tuple[dict[str, float], list[str]]:
        """Return the numbers that are typed by key, and sentences on those that are none."""
        found, wrong = {}, []
        for key, line in self._lines.items():
            text, fault = line.text().strip(), ""
            if text and not line.isHidden():
                try:
                    found[key] = read_number(text)
                    if not found[key] > 0.0:
                        fault = "it must be above 0"
                except NumberTextError as error:
                    fault = str(error)
            set_wrong(line, bool(fault))
            if fault:
                caption = self.form.labelForField(line)
                words = caption.text().replace("&", "") if isinstance(caption, QLabel) else key
                wrong.append(f"{words}: {fault}.")
        return found, wrong

    def metadata(self, numbers: dict[str, float]) -> RunMetadata:
        """Return film, load and remarks of the recording. Raises ``InputError``."""
        session = self._session
        actuator, rig = self._kind == "actuator", self.raw
        given = {key: numbers.get(key) for key, _, _ in _FILM} if actuator and not rig else {}
        return imported_metadata(
            session.rig_text if actuator and rig else "",
            session.rig_file if actuator and rig else None,
            "",  # the film and the notes of the next run are not those of these data
            "",
            kinematics=self.kinematics.currentData() or None,
            **given,
        )

    @Slot()
    def _take_stated(self) -> None:
        stated = self._stated
        for key, value in (
            ("gauge_length_mm", stated.gauge_length_mm),
            ("area_mm2", stated.area_mm2),
        ):
            if value is not None:
                self._lines[key].setText(f"{value:g}")
        self.changed.emit()

    @Slot()
    def _film_changed(self) -> None:
        self.show_kind(self._kind, self._there)
        self.changed.emit()

    @Slot()
    def _changed(self) -> None:
        self.changed.emit()
