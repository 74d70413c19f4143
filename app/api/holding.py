"""A displacement that is held against creep, with feedback during the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dearig.acquisition.rigs import check_simulation
from dearig.acquisition.run import RunOptions
from dearig.analysis import hold as holding
from dearig.analysis.hold import HoldOptions
from dearig.api.arguments import named_arguments
from dearig.api.display import card, drawing, write_page
from dearig.api.models import ModelSource, read_model
from dearig.api.recordings import Recording, RigSource, load_rig, rig_provenance
from dearig.api.written import HasFiles, HasPage, Writers
from dearig.progress import Progress, quiet
from dearig.recording.json_file import write_json
from dearig.recording.reading.origin import origin_of
from dearig.recording.reading.reader import open_recording
from dearig.report.pages.hold import hold_figure, hold_json, hold_summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["HoldOptions", "HoldResult", "hold"]

_DEFAULT = HoldOptions()


@dataclass(frozen=True, eq=False, repr=False)
class HoldResult(HasFiles, HasPage):
    """Result of a hold, saved as ``.json`` (all numbers).

    Attributes
    ----------
    outcome : HoldOutcome
        All numbers of the hold, in SI units.
    """

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
        """Plot the mean error and the mean correction of every minute.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.
        """
        return hold_figure(self.outcome)

    def _write_page(self, path: Path) -> Path:
        return write_page(
            path, self._title, "Hold", self._repr_html_(), (origin_of(self.recording),)
        )

    def _writers(self) -> Writers:
        return {".json": ("all numbers", lambda out, _: write_json(hold_json(self.outcome), out))}

    def __repr__(self) -> str:
        """Return the summary in sentences."""
        return "\n".join(hold_summary(self.outcome))

    def _repr_html_(self) -> str:
        figure = drawing(self.plot(), f"{self._title}: error and correction of every minute")
        return card(self._title, figure, sentences=hold_summary(self.outcome))

    @property
    def _title(self) -> str:
        return f"Hold of {self.outcome.setpoint * 1e3:.4g} mm"


@named_arguments
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
    rig : str
        ``sim``, ``sim:SEED`` for a simulated rig with a hidden effect, ``daqmx:Dev1`` for a card.
    rig_file : path or mapping, optional
        Film, load, instruments and limits. The limit of the time at voltage must allow the hold.
    options : HoldOptions
        Authority (fraction of the voltage), rate limit in 1/s, and response, rise and queue of the
        feedback in s.
    feedback : bool
        False plays the model's voltage alone.
    operator, film, notes : str
        Texts that are kept in the recording.
    seed : int
        Seed of the simulated noise.
    paced : bool
        Simulate in real time; otherwise as fast as possible.
    faults : iterable of str
        Faults of a simulated rig, such as ``arc@3.2`` (kind, seconds).
    overwrite : bool
        Replace the recording.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    HoldResult
        The recording, the error in um, and error and correction of every minute.

    Raises
    ------
    InputError
        If the displacement cannot be held, or the gate refuses the voltage.
    SafetyStop, InstrumentFault, DiskFault, Interrupted
        If the run ended early. The rig is safe, and the recording so far is kept.

    Examples
    --------
    >>> import dearig
    >>> held = dearig.hold(0.5, "model.toml", seconds=60.0, out="hold.h5")
    >>> held.rms_um
    """
    check_simulation(rig, seed, paced)
    settings, text = load_rig(rig_file)
    outcome = holding.hold(
        displacement_mm * 1e-3, seconds, read_model(model), rig, settings, Path(out),
        RunOptions(
            text, operator, film, notes, overwrite=overwrite, seed=seed, paced=paced,
            faults=faults, provenance=rig_provenance(rig_file),
        ),
        options, feedback=feedback, progress=progress,
    )  # fmt: skip
    return HoldResult(outcome)
