"""A displacement that the film follows: the voltage for it, and runs that learn."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dearig.acquisition.rigs import check_simulation
from dearig.acquisition.run import RunOptions
from dearig.analysis.track import track as follow
from dearig.analysis.track_target import plan_target
from dearig.analysis.tracking import TrackedRun, TrackOutcome
from dearig.api.arguments import named_arguments
from dearig.api.display import card, drawing, facts, table_html, write_page
from dearig.api.models import ModelSource, read_model
from dearig.api.recordings import Recording, RigSource, load_rig, rig_provenance
from dearig.api.written import HasFiles, HasPage, Writers
from dearig.config.targetfile import LoadedTarget, load_target, target_of
from dearig.errors import InputError
from dearig.model.control import Unreachable
from dearig.model.control import inversion as control
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.recording.files import replaced_when_done
from dearig.recording.json_file import write_json
from dearig.recording.reading.reader import open_recording
from dearig.report.figures.signals import signal_figure
from dearig.report.pages.track import (
    errors_figure,
    runs_figure,
    runs_table,
    track_json,
    track_summary,
    write_track_report,
)
from dearig.report.text.numbers import seconds, significant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Inversion", "TargetSource", "TrackResult", "invert", "track"]

#: The path of a target file, or time (N,) in s and displacement (N,) in m.
TargetSource = str | Path | tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False, repr=False)
class Inversion(HasFiles, HasPage):
    """Voltage with which a model follows a target; arrays are (N,) in SI units.

    It is saved as ``.csv``, a table that a sequence can play.

    Attributes
    ----------
    name : str
        Name of the target.
    inversion : dearig.model.control.Inversion
        All values of the inversion.
    """

    name: str
    inversion: control.Inversion

    @property
    def time(self) -> np.ndarray:
        """Time in s, with lead-in and tail."""
        return self.inversion.time

    @property
    def voltage(self) -> np.ndarray:
        """Voltage in V, held from sample to sample."""
        return self.inversion.voltage

    @property
    def target(self) -> np.ndarray:
        """The asked displacement in m."""
        return self.inversion.target

    @property
    def reference(self) -> np.ndarray:
        """The nearest feasible target in m."""
        return self.inversion.reference

    @property
    def response(self) -> np.ndarray:
        """The displacement in m that the model reads under the voltage."""
        return self.inversion.reading

    @property
    def unreachable(self) -> tuple[Unreachable, ...]:
        """The parts of the target that the film cannot follow: when, why and by how much."""
        return self.inversion.unreachable

    @property
    def feasible(self) -> bool:
        """True if the film can follow the whole target."""
        return self.inversion.feasible

    def plot(self) -> Figure:
        """Plot the voltage, and target and response over time.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.
        """
        return signal_figure("actuator", self.time, self.voltage, self.target, self.response)

    def _writers(self) -> Writers:
        def table(out: Path, overwrite: bool) -> None:
            rows = np.column_stack([self.time, self.voltage])
            with replaced_when_done(out, overwrite) as partial:
                np.savetxt(partial, rows, fmt="%.12g", delimiter=",", header="time_s,voltage_V",
                           comments="")  # fmt: skip

        return {".csv": ("the voltage, as a table that a sequence can play", table)}

    def _write_page(self, path: Path) -> Path:
        return write_page(path, self.name, "Voltage for a target", self._repr_html_())

    def __repr__(self) -> str:
        """Return name, peak voltage and what is unreachable."""
        said = "feasible" if self.feasible else f"{len(self.unreachable)} parts unreachable"
        peak = float(self.voltage.max()) * 1e-3
        return f"<Inversion {self.name!r}: up to {significant(peak)} kV, {said}>"

    def _repr_html_(self) -> str:
        rows = [
            ("samples", f"{self.time.size:,}, {seconds(float(self.time[-1]))}"),
            ("voltage", f"up to {significant(float(self.voltage.max()) * 1e-3)} kV"),
            *(("not reachable", part.sentence) for part in self.unreachable),
        ]
        return card(self.name, facts(rows), drawing(self.plot(), f"{self.name} over time"))


@dataclass(frozen=True, eq=False, repr=False)
class TrackResult(HasFiles, HasPage):
    """Result of following a target, saved as ``.json`` (all numbers).

    Attributes
    ----------
    outcome : TrackOutcome
        All numbers of the runs, in SI units.
    """

    outcome: TrackOutcome

    @property
    def inversion(self) -> Inversion:
        """What the model says can be reached, before any run."""
        return Inversion(self.outcome.target.name, self.outcome.inversion)

    @property
    def runs(self) -> tuple[TrackedRun, ...]:
        """All runs with their errors in m, those that were compared first."""
        return self.outcome.runs

    @property
    def best(self) -> Recording:
        """The recording of the run with the smallest error. Raises ``InputError`` without one."""
        best = self.outcome.best
        if best is None:
            raise InputError("no run was finished")
        return Recording.of(open_recording(best.recording), best.margins)

    def plot(self, what: str = "runs") -> Figure:
        """Plot runs or errors.

        Parameters
        ----------
        what : str
            ``runs`` (over time) or ``errors`` (of all iterations).

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.

        Raises
        ------
        InputError
            If nothing of that name can be plotted.
        """
        if what not in ("runs", "errors"):
            raise InputError(f"{what!r} cannot be plotted; what can is runs, errors")
        return (runs_figure if what == "runs" else errors_figure)(self.outcome)

    def _write_page(self, path: Path) -> Path:
        return write_track_report(self.outcome, path)

    def _writers(self) -> Writers:
        return {".json": ("all numbers", lambda out, _: write_json(track_json(self.outcome), out))}

    def __repr__(self) -> str:
        """Return the summary in sentences."""
        return "\n".join(track_summary(self.outcome))

    def _repr_html_(self) -> str:
        name = self.outcome.target.name
        return card(
            f"Tracking: {name}",
            table_html(runs_table(self.outcome)),
            drawing(self.plot(), f"Runs of {name} over time"),
            sentences=track_summary(self.outcome),
        )


@named_arguments
def invert(
    model: ModelSource, target: TargetSource, *, rig_file: RigSource | None = None
) -> Inversion:
    """Compute the voltage with which a model follows a displacement.

    Parameters
    ----------
    model : model, result or path
        An actuator, for example the model of a diagnosis.
    target : path, or two arrays
        A target file (TOML or CSV), or time in s and displacement in m from the loaded rest state,
        which starts and ends at 0.
    rig_file : path or mapping, optional
        Limits and sample rate.

    Returns
    -------
    Inversion
        Voltage in V, the displacement that is expected in m, and the parts of the target that the
        film cannot follow.

    Raises
    ------
    InputError
        If the target or the model cannot be used. An unreachable part of the target raises nothing:
        see ``Inversion.unreachable``.

    Examples
    --------
    >>> import dearig
    >>> found = dearig.invert("model.toml", "target.toml")
    >>> found.feasible
    >>> found.save("voltage.csv")
    """
    loaded, settings = _target(target), load_rig(rig_file)[0]
    file = read_model(model)
    if not isinstance(file.model, Actuator):
        raise InputError(
            f"the model {file.name!r} is of a bare film, which a voltage does not move"
        )
    return Inversion(loaded.name, plan_target(loaded, file.model, settings))


@named_arguments
def track(
    target: TargetSource,
    model: ModelSource,
    *,
    out: str | Path,
    rig: str = "sim",
    rig_file: RigSource | None = None,
    iterations: int = 5,
    compare: ModelSource | None = None,
    nearest: bool = False,
    within_um: float = 5.0,
    operator: str = "",
    film: str = "",
    notes: str = "",
    seed: int = 0,
    paced: bool = False,
    faults: Iterable[str] = (),
    overwrite: bool = False,
    progress: Progress = quiet,
) -> TrackResult:
    """Make the film follow a displacement, and learn from run to run.

    Parameters
    ----------
    target : path, or two arrays
        A target file (TOML or CSV), or time in s and displacement in m from the loaded rest state,
        which starts and ends at 0.
    model : model, result or path
        An actuator, for example the model of a diagnosis.
    out : path
        Folder for the recordings and the sequences that were played.
    rig : str
        ``sim``, ``sim:SEED`` for a simulated rig with a hidden effect, ``daqmx:Dev1`` for a card.
    rig_file : path or mapping, optional
        Film, load, instruments and limits.
    iterations : int
        Number of runs that learn from the one before.
    compare : model, result or path, optional
        First play the voltage of this model, such as the thesis's, and that of a linear map. It
        is followed in place of ``model`` if its run contradicts ``model``.
    nearest : bool
        Follow the nearest feasible target where the film cannot follow the requested one.
    within_um : float
        Distance from the target in um that is accepted without ``nearest``.
    operator, film, notes : str
        Texts that are kept in the recording.
    seed : int
        Seed of the simulated noise.
    paced : bool
        Simulate in real time; otherwise as fast as possible.
    faults : iterable of str
        Faults of a simulated rig, such as ``arc@3.2`` (kind, seconds).
    overwrite : bool
        Replace recordings in ``out``.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    TrackResult
        All runs with their errors in m, and the recording of the best.

    Raises
    ------
    InputError
        If the target cannot be reached, or the gate refuses a voltage.
    SafetyStop, InstrumentFault, DiskFault, Interrupted
        If a run ended early. The rig is safe, and the recordings so far are kept.

    Examples
    --------
    >>> import dearig
    >>> followed = dearig.track("target.toml", "model.toml", out="runs")
    >>> followed.plot("errors")
    """
    check_simulation(rig, seed, paced)
    settings, text = load_rig(rig_file)
    outcome = follow(
        _target(target), read_model(model), rig, settings, Path(out),
        RunOptions(
            text, operator, film, notes, overwrite=overwrite, seed=seed, paced=paced,
            faults=faults, provenance=rig_provenance(rig_file),
        ),
        iterations=iterations, compare=None if compare is None else read_model(compare),
        nearest=nearest, within=within_um * 1e-6, progress=progress,
    )  # fmt: skip
    return TrackResult(outcome)


def _target(source: TargetSource) -> LoadedTarget:
    if isinstance(source, str | Path):
        return load_target(source)
    time, displacement = source
    return target_of(time, displacement)
