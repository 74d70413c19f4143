"""State that the pages of the window share, with signals for its changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, QSettings, Signal

from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.plan import Plan
from dearig.acquisition.rig_source import source_of
from dearig.analysis.hold import HoldPlan
from dearig.config.modelfile import model_toml
from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, SequenceFault
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.window.jobs.program_errors import ProgramErrors
from dearig.window.kit.theme import LIGHT, Theme
from dearig.window.session.recovery import Recovery
from dearig.window.session.settings import HeldSettings, kept_text, kept_texts

__all__ = ["ArmingBlock", "Breach", "Preview", "Session"]

_RECENT_MAX = 8
FIRST_SEQUENCE = "thesis"


@dataclass(frozen=True)
class ArmingBlock:
    """Why the rig cannot be armed: a ``sentence``, and the title of the ``page`` that mends it."""

    sentence: str
    page: str = ""


@dataclass(frozen=True)
class Breach:
    """Time span ``first`` to ``last`` s in which a plan exceeds the limit of ``quantity``."""

    quantity: str
    first: float
    last: float


@dataclass(frozen=True)
class Preview:
    """The text of a sequence and its plan, or a ``sentence`` that says why there is none.

    ``curves`` are (time in s, value in SI units) of voltage, displacement and field, decimated with
    their extremes kept; ``segments`` are label, begin and end in s, with lead-in and tail.
    ``faults`` are those of the rows and fields of the sequence, all of them. An outline has the
    curves of a plan by kernels that are not compiled, its name as ``sentence``, and is not a plan.
    """

    toml: str
    loaded: LoadedSequence | None = None
    plan: Plan | None = None
    sentence: str = ""
    curves: Mapping[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    breaches: tuple[Breach, ...] = ()
    segments: tuple[tuple[str, float, float], ...] = ()
    faults: tuple[SequenceFault, ...] = ()
    is_outline: bool = False

    @property
    def playable(self) -> bool:
        """True if the gate accepts the plan."""
        return self.plan is not None and self.plan.waveform is not None

    @property
    def duration(self) -> float:
        """Time in s from the first to the last sample, 0 without a plan."""
        if self.plan is not None:
            return self.plan.duration
        return float(self.segments[-1][2]) if self.is_outline else 0.0

    @property
    def digest(self) -> str:
        """Digest of the waveform that the gate has admitted, "" without one."""
        waveform = None if self.plan is None else self.plan.waveform
        return "" if waveform is None else waveform.digest


class Session(QObject):
    """Rig, sequence, overlay models, folder, and the operator's entries for a recording.

    ``rig_changed``: address or rig file; ``sequence_changed``: its text; ``preview_changed``: its
    plan is ready; ``recorded``: a new recording is in the folder; ``running_changed``: a run has
    begun (True) or ended (False); ``blocks_changed``: what blocks arming. During a run nothing that
    it uses may be changed.
    """

    rig_changed = Signal()
    sequence_changed = Signal()
    preview_changed = Signal()
    outline_changed = Signal()  #: an outline of the plan is there, or none any more
    overlays_changed = Signal()
    folder_changed = Signal()
    notes_changed = Signal()
    theme_changed = Signal()
    recent_changed = Signal()
    recorded = Signal(Path)
    running_changed = Signal(bool)
    armed_changed = Signal(bool)
    arming = Signal()  #: the rig is about to be armed: what takes the window long is done now
    study_finished = Signal(object)  #: a ``Study`` has just been saved in the folder
    hold_changed = Signal()  #: another feedback belongs to the sequence
    blocks_changed = Signal()
    output_read = Signal(object)  #: state of the output, read at rest
    message = Signal(str)  #: text for the status bar

    def __init__(
        self,
        folder: Path,
        settings: QSettings,
        *,
        address: str = "sim",
        theme: Theme = LIGHT,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.settings = settings
        self.program_errors = ProgramErrors(self)
        self.address = address
        self.rig_path: Path | None = None
        self.rig_text = ""
        self.rig_file = RigFile()
        self.sequence_toml = PRESETS[FIRST_SEQUENCE]
        self.sequence_folder = Path()
        self.sequence_path: Path | None = None
        self.preview: Preview | None = None
        self.outline: Preview | None = None
        self.overlays: tuple[OverlayModel, ...] = (self.thesis_model,)
        self.overlay_drive = "command"
        self.folder = folder
        self.operator = kept_text(settings, "operator")
        self.film = kept_text(settings, "film")
        self.notes = ""
        self.theme = theme
        self.running = False
        self.armed = False
        self._feedforward = ""  # text of the sequence of the last hold
        self._hold: tuple[HoldPlan, tuple[object, ...]] | None = None
        self._blocks: dict[str, ArmingBlock] = {}
        self._held = HeldSettings(settings, lambda: self.busy, self)
        self.recovery = Recovery(settings, self)  #: unsaved sequence and rig file

    def set_address(self, address: str) -> None:
        """Use the rig ``sim``, ``sim:7``, ``daqmx:Dev1`` or ``daqmx:Dev1@HOST:PORT``.

        Nothing changes while a run or a campaign goes on.
        """
        if address != self.address and not self._keeps_rig():
            self.address = address
            self._block_feedforward()
            self.rig_changed.emit()

    @property
    def rig_name(self) -> str:
        """Name of the rig file in force, for a person."""
        if self.rig_path is not None:
            return self.rig_path.name
        return "a rig file that is not saved" if self.rig_text else "the rig file of the thesis"

    @property
    def rig_source(self) -> str:
        """Where the rig file in force came from, in words."""
        if self.rig_path is None and self.rig_text:
            return "settings of the window that are in no file"
        return source_of(self.rig_path)

    def set_rig_file(self, path: Path | None, text: str, rig_file: RigFile) -> None:
        """Use a rig file; recordings keep its ``text``. ``path`` is None if it is not saved.

        Nothing changes while a run or a campaign goes on.
        """
        if self._keeps_rig():
            return
        self.rig_path, self.rig_text, self.rig_file = path, text, rig_file
        self.preview = None  # it was planned with other limits
        self._block_feedforward()
        self.rig_changed.emit()
        if any(model.path is None for model in self.overlays):
            thesis = self.thesis_model
            overlays = tuple(thesis if m.path is None else m for m in self.overlays)
            self.set_overlays(overlays, self.overlay_drive)

    def _keeps_rig(self) -> bool:
        """Return True, and say so, while something plays: numbers and alarms are of its rig."""
        if self.running:
            self.message.emit("The rig stays as it is until the run has ended")
        return self.running

    def set_sequence(self, toml: str, folder: Path, path: Path | None = None) -> None:
        """Use the sequence ``toml``; its CSV files are in ``folder``."""
        if (toml, folder, path) == (self.sequence_toml, self.sequence_folder, self.sequence_path):
            return
        self.sequence_toml, self.sequence_folder, self.sequence_path = toml, folder, path
        self.preview = None  # the plan of the previous sequence
        self._block_feedforward()
        self.sequence_changed.emit()

    def set_hold(self, hold: HoldPlan) -> None:
        """Let the feedback of ``hold`` correct the runs of the present sequence, which is its own.

        Any change of the sequence, the rig, the rig file or the film removes it. What is left of an
        unchanged sequence then is its ramps without their feedback, which are not the hold: arming
        is blocked.
        """
        self._hold, self._feedforward = (hold, self._hold_conditions()), self.sequence_toml
        self._block_feedforward()
        self.hold_changed.emit()

    @property
    def is_feedforward(self) -> bool:
        """True while the sequence is that of a hold, with its feedback or without."""
        return bool(self._feedforward) and self.sequence_toml == self._feedforward

    def _block_feedforward(self) -> None:
        if self.is_feedforward and self.hold is None:
            self.block(
                "hold",
                "the feedback of the hold was removed with the change of rig, rig file or film, "
                "and its ramps alone do not hold the film; prepare the hold again, or choose "
                "another sequence",
                "Follow",
            )
        else:
            self.unblock("hold")

    @property
    def hold(self) -> HoldPlan | None:
        """The hold that the present sequence belongs to, None for a run without feedback."""
        if self._hold is None or self._hold[1] != self._hold_conditions():
            return None
        return self._hold[0]

    def _hold_conditions(self) -> tuple[object, ...]:
        return self.sequence_toml, self.address, self.rig_file, self.film

    def set_outline(self, outline: Preview | None) -> None:
        """Set what is shown of the plan until the model is compiled; None for nothing."""
        self.outline = outline
        self.outline_changed.emit()

    def set_preview(self, preview: Preview) -> None:
        """Set the plan of the present sequence."""
        self.preview = preview
        self.preview_changed.emit()

    def set_overlays(self, overlays: tuple[OverlayModel, ...], drive: str = "command") -> None:
        """Use these overlay models, at most two, driven by ``command`` or ``monitor``."""
        self.overlays, self.overlay_drive = overlays[:2], drive
        self.overlays_changed.emit()

    @property
    def thesis_model(self) -> OverlayModel:
        """Thesis model: the springs of Table 3 with the film and the load of the rig file."""
        name = "thesis (Table 3)"
        actuator = Actuator(self.rig_file.as_film(), self.rig_file.as_load(), TABLE_3)
        return OverlayModel(name, actuator, toml=model_toml(name, actuator, {}))

    def set_folder(self, folder: Path) -> None:
        """Use another folder for recordings."""
        if folder != self.folder:
            self.folder = folder
            self.folder_changed.emit()

    def set_notes(self, operator: str, film: str, notes: str) -> None:
        """Set operator, film and notes; operator and film are kept for the next start."""
        film_before, self.operator, self.film, self.notes = self.film, operator, film, notes
        self.settings.setValue("operator", operator)
        self.settings.setValue("film", film)
        self._block_feedforward()
        self.notes_changed.emit()
        if film != film_before and self.rig_file.film.name:  # the limits hold for one film
            self.preview = None
            self.sequence_changed.emit()

    def set_theme(self, theme: Theme) -> None:
        """Use another theme."""
        if theme != self.theme:
            self.theme = theme
            self.theme_changed.emit()

    def set_running(self, running: bool) -> None:
        """Say that a run has begun or ended."""
        if running != self.running:
            self.running = running
            self.running_changed.emit(running)
            self._held.write()

    def set_armed(self, armed: bool) -> None:
        """Say that the rig was armed or disarmed."""
        if armed != self.armed:
            self.armed = armed
            self.armed_changed.emit(armed)
            self._held.write()

    @property
    def busy(self) -> bool:
        """True while the rig is armed or a run goes on: STOP must be within reach."""
        return self.armed or self.running

    @property
    def blocks(self) -> dict[str, ArmingBlock]:
        """What blocks arming, by key; the rig is armed only while this is empty."""
        return dict(self._blocks)

    def block(self, key: str, sentence: str, page: str = "") -> None:
        """Refuse to arm until ``unblock``; a rig that is armed is disarmed.

        The ``sentence`` stands next to the Arm button, and on a banner of every page where ``page``
        is given, the title of the page that mends it.
        """
        wanted = ArmingBlock(sentence, page)
        if self._blocks.get(key) != wanted:
            self._blocks[key] = wanted
            self.blocks_changed.emit()

    def unblock(self, key: str) -> None:
        """End the block ``key``, if there is one."""
        if self._blocks.pop(key, None) is not None:
            self.blocks_changed.emit()

    @property
    def recent(self) -> list[Path]:
        """Recently used sequence files, the newest first."""
        return [Path(name) for name in kept_texts(self.settings, "recent", _RECENT_MAX)]

    def add_recent(self, path: Path) -> None:
        """Put ``path`` first among the recent sequence files."""
        names = [str(path), *(str(p) for p in self.recent if p != path)]
        self.settings.setValue("recent", names[:_RECENT_MAX])
        self.recent_changed.emit()
