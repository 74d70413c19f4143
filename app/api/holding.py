"""A displacement that is held against creep, with feedback during the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dearig.acquisition.rigs import read_faults
from dearig.acquisition.run import RunOptions
from dearig.analysis import hold as holding
from dearig.analysis.hold import HoldOptions
from dearig.api.display import card, drawing, write_page
from dearig.api.models import ModelSource, read_model
from dearig.api.recordings import Recording, RigSource, load_rig, rig_provenance
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.files import check_output
from dearig.recording.json_file import write_json
from dearig.recording.reading.origin import origin_of
from dearig.recording.reading.reader import open_recording
from dearig.report.pages.hold import hold_figure, hold_json, hold_summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["HoldOptions", "HoldResult", "hold"]

_DEFAULT = HoldOptions()


@dataclass(frozen=True, eq=False, repr=False)
class HoldResult:
    """A displacement that was held; ``outcome`` has everything that is known of it, in SI units."""

    outcome: holding.HoldOutcome

    @property
    def recording(self) -> Recording:
        """The recording of the run."""
        return Recording.of(open_recording(self.outcome.recording), self.outcome.run.margins)

    @property
    def rms_um(self) -> float:
        """Setpoint minus reading over the hold in um, RMS; the noise of a reading is in it."""
        return self.outcome.rms * 1e6

    def plot(self) -> Figure:
        """Return a figure of the mean error and the mean correction of every minute."""
        return hold_figure(self.outcome)

    def to_html(self, path: str | Path) -> Path:
        """Write a page with the summary and the figure to ``path``, replacing it."""
        return write_page(
            path, self._title, "Hold", self._repr_html_(), (origin_of(self.recording),)
        )

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write all numbers (``.json``) to ``path`` and return the path. Raises ``InputError``."""
        out = check_output(path, overwrite)
        if out.suffix != ".json":
            raise InputError(f"{path}: all numbers are written as JSON; end the name in .json")
        write_json(hold_json(self.outcome), out)
        return out

    def __repr__(self) -> str:
        """Return the summary in sentences."""
        return "\n".join(hold_summary(self.outcome))

    def _repr_html_(self) -> str:
        figure = drawing(self.plot(), f"{self._title}: error and correction of every minute")
        return card(self._title, figure, sentences=hold_summary(self.outcome))

    @property
    def _title(self) -> str:
        return f"Hold of {self.outcome.setpoint * 1e3:.4g} mm"


def hold(
    displacement_mm: float,
    model: ModelSource,
    *,
    seconds: float,
    out: str | Path,
    rig: str = "sim",
    rig_file: RigSource | None = None,
    options: HoldOptions = _DEFAULT,
    feedback: bool = True,
    operator: str = "",
    film: str = "",
    notes: str = "",
    seed: int = 0,
    paced: bool = False,
    faults: Iterable[str] = (),
    overwrite: bool = False,
    progress: Progress = quiet,
) -> HoldResult:
    """Hold a displacement against creep, with feedback from the laser.

    Parameters
    ----------
    displacement_mm : float
        Displacement from the loaded rest state in mm.
    model : model, result or path
        An actuator: its voltage is played, and corrected by the feedback.
    seconds : float
        Length of the hold in s.
    out : path
        The recording.
    rig, rig_file
        As for ``record``. The limit of the time at voltage must allow the hold.
    options : HoldOptions
        Authority, rate limit and response of the feedback, and what waits for output.
    feedback : bool
        False plays the model's voltage alone.
    operator, film, notes, seed, paced, faults, overwrite, progress
        As for ``record``.

    Raises
    ------
    InputError
        For a displacement that cannot be held, and for a voltage that the gate refuses.
    SafetyStop, InstrumentFault, DiskFault, Interrupted
        For a run that ended early. The rig is safe, and the recording so far is kept.
    """
    settings, text = load_rig(rig_file)
    outcome = holding.hold(
        displacement_mm * 1e-3, seconds, read_model(model), rig, settings, Path(out),
        RunOptions(
            text, operator, film, notes, overwrite=overwrite, seed=seed, paced=paced,
            faults=read_faults(faults), provenance=rig_provenance(rig_file),
        ),
        options, feedback=feedback, progress=progress,
    )  # fmt: skip
    return HoldResult(outcome)
