"""Choice of the models that run in step with a measurement, and of their drive."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Qt, Slot
from PySide6.QtWidgets import QComboBox, QWidget

from dearig.acquisition.overlay import OverlayModel
from dearig.config.modelfile import load_actuator, load_model
from dearig.config.toml_input import read_text
from dearig.window.documents.dialogs import choose_file
from dearig.window.jobs.background import Background
from dearig.window.kit.flow import Flow
from dearig.window.kit.widgets import Message, label, plain_tip
from dearig.window.session.state import Session

__all__ = ["OverlayChooser", "read_overlay"]

_NO_MODEL, _OPEN = "no model", "Open a model file …"


class OverlayChooser(QWidget):
    """Two model boxes and a drive box; they change ``session.overlays``.

    ``message`` shows why a model file cannot be read; the page decides where it stands.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._to_load: list[tuple[int, Path]] = []  # place 0 or 1, file
        self._loading = Background(self)
        self._loading.done.connect(self._loaded)
        self._loading.failed.connect(self._load_failed)
        self.message = Message()
        self.models = [QComboBox(), QComboBox()]
        self.drive = QComboBox()
        row = Flow(self)
        caption = label("Overlay &models")
        caption.setBuddy(self.models[0])
        for place, choice in enumerate(self.models):
            choice.setToolTip("Model that runs in step with the data; may be changed at any time")
            choice.setAccessibleName(f"Overlay model {place + 1}")
            choice.setSizeAdjustPolicy(
                QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
            )
            choice.setMinimumContentsLength(12)
            choice.activated.connect(lambda _, place=place: self._chosen(place))
            row.add(*(() if place else (caption,)), choice, share=1)
        self.drive.addItem("driven by the command", "command")
        self.drive.addItem("driven by the monitor", "monitor")
        self.drive.setToolTip("Voltage (kV) that drives the models")
        self.drive.setAccessibleName("Drive of the overlay models")
        self.drive.activated.connect(self._drive_changed)
        row.add(self.drive)
        session.overlays_changed.connect(self.refresh)
        self.refresh()

    def load(self, path: Path, place: int = 0) -> None:
        """Read the model file ``path`` and use its model in ``place`` 0 or 1."""
        self._to_load.append((place, path))
        self._load_next()

    def close_work(self) -> None:
        """Wait for the thread that reads model files."""
        self._loading.close()

    @Slot()
    def refresh(self) -> None:
        """List the models of the session."""
        session = self._session
        known = [session.thesis_model, *(m for m in session.overlays if m.path is not None)]
        for place, choice in enumerate(self.models):
            with QSignalBlocker(choice):
                choice.clear()
                choice.addItem(_NO_MODEL, None)
                for model in known:
                    choice.addItem(model.name, model)
                    if model.path is not None:
                        choice.setItemData(
                            choice.count() - 1,
                            plain_tip(str(model.path)),
                            Qt.ItemDataRole.ToolTipRole,
                        )
                choice.addItem(_OPEN, _OPEN)
                chosen = session.overlays[place] if place < len(session.overlays) else None
                choice.setCurrentIndex(0 if chosen is None else 1 + known.index(chosen))

    def _chosen(self, place: int) -> None:
        chosen = self.models[place].currentData()
        if chosen == _OPEN:
            self.refresh()  # the previous model stays until the new one is read
            path = choose_file(
                self, self._session, "Overlay model", self._session.folder, "Models (*.toml)"
            )
            if path is not None:
                self.load(path, place)
            return
        self._place(place, chosen)

    def _place(self, place: int, model: OverlayModel | None) -> None:
        overlays = list(self._session.overlays)
        if model is None:
            overlays = overlays[:place] + overlays[place + 1 :]
        elif place < len(overlays):
            overlays[place] = model
        else:
            overlays.append(model)
        self._session.set_overlays(tuple(overlays), self.drive.currentData())

    @Slot()
    def _drive_changed(self) -> None:
        self._session.set_overlays(self._session.overlays, self.drive.currentData())

    def _load_next(self) -> None:
        if self._to_load and not self._loading.busy:
            _, path = self._to_load[0]
            self._loading.start(lambda: read_overlay(path))

    @Slot(object)
    def _loaded(self, model: OverlayModel) -> None:
        place, _ = self._to_load.pop(0)
        self.message.show_text("")
        self._place(place, model)
        self._load_next()

    @Slot(str)
    def _load_failed(self, sentence: str) -> None:
        self._to_load.pop(0)
        self.message.show_text(sentence, "bad")
        self._load_next()


def read_overlay(path: Path) -> OverlayModel:
    """Return the overlay model in the file at ``path``. Raises ``InputError``."""
    actuator = load_actuator(path)
    name = load_model(path).name
    return OverlayModel(name or path.stem, actuator, path, read_text(path, "model file"))
