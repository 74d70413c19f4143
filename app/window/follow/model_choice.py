"""Choice of the model with which the voltage of a target is computed."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Qt, Signal, Slot
from PySide6.QtWidgets import QComboBox, QWidget

from dearig.report.study_file import StudyEntry, studies_in
from dearig.window.documents.dialogs import choose_file
from dearig.window.jobs.background import Background
from dearig.window.kit.widgets import plain_tip
from dearig.window.session.state import Session

__all__ = ["ModelChoice"]

_OPEN = "Open a model …"
_STUDIES_MAX = 30  # a longer list does not fit on a screen


class ModelChoice(QComboBox):
    """The thesis model, the models of the studies in the folder, and model files.

    ``changed``: another model is chosen.
    """

    changed = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._files: list[Path] = []  # that were opened
        self._studies: tuple[StudyEntry, ...] = ()
        self._chosen: Path | None = None
        self._listing = Background(self)
        self._listing.done.connect(self._listed)
        self.setToolTip("Model that computes the voltage: best one that a diagnosis has found")
        self.setAccessibleName("Model")
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(16)
        self.activated.connect(self._activated)
        session.folder_changed.connect(self.find_studies)
        session.study_finished.connect(self.find_studies)
        self._fill()
        self.find_studies()

    @property
    def path(self) -> Path | None:
        """File of the chosen model, None for the thesis model."""
        return self._chosen

    def use(self, path: Path) -> None:
        """Choose the model in the file ``path``."""
        self._chosen = path
        self._fill()
        self.changed.emit()

    def close_work(self) -> None:
        """Wait for the thread that lists the studies."""
        self._listing.close()

    @Slot()
    def find_studies(self) -> None:
        """List the studies of the folder again."""
        folder = self._session.folder
        self._listing.start(lambda: studies_in(folder))

    @Slot(object)
    def _listed(self, found: tuple[StudyEntry, ...]) -> None:
        self._studies = found[:_STUDIES_MAX]
        self._fill()

    def _fill(self) -> None:
        studies = {folder / "model.toml": f"{folder.name}: {headline}"
                   for folder, headline, _ in self._studies}  # fmt: skip
        chosen = self._chosen
        if chosen is not None and chosen not in studies and chosen not in self._files:
            self._files.append(chosen)
        with QSignalBlocker(self):
            self.clear()
            self.addItem("Thesis model (Table 3)", None)
            for path, words in studies.items():
                self._add(words, path)
            for path in self._files:
                if path not in studies:
                    self._add(path.name, path)
            self.addItem(_OPEN, _OPEN)
            self.setCurrentIndex(max(self._place(chosen), 0))

    def _add(self, words: str, path: Path) -> None:
        self.addItem(words, path)
        tip = plain_tip(f"{words}\n{path}")
        self.setItemData(self.count() - 1, tip, Qt.ItemDataRole.ToolTipRole)

    def _place(self, path: Path | None) -> int:
        return next((i for i in range(self.count()) if self.itemData(i) == path), -1)

    @Slot()
    def _activated(self) -> None:
        chosen = self.currentData()
        if chosen != _OPEN:
            self._chosen = chosen
            self.changed.emit()
            return
        self._fill()  # the former model stays until another is chosen
        path = choose_file(self, self._session, "Model", self._session.folder, "Models (*.toml)")
        if path is not None:
            self.use(path)
