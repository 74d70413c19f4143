"""Displacement from voltage and current alone, as a value for a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.readings.opening import Source
from dearig.analysis.readings.sense import SenseOutcome, save_sensed, sense_recording
from dearig.api.arguments import named_arguments
from dearig.api.display import card, drawing
from dearig.api.models import ModelSource, as_model_file
from dearig.api.written import HasFiles, Writers
from dearig.recording.json_file import write_json
from dearig.report.figures.signals import signal_figure
from dearig.report.sensed import sense_json, sense_texts, sensed_texts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SenseResult", "sense"]


@dataclass(frozen=True, eq=False, repr=False)
class SenseResult(HasFiles):
    """Displacement of a recording from voltage and current; arrays are (N,) in SI units.

    It is saved as ``.csv`` (a row for each time) or ``.json`` (all numbers).

    Attributes
    ----------
    outcome : dearig.analysis.readings.sense.SenseOutcome
        All values, with the offset and the conduction of the current that were found.
    """

    outcome: SenseOutcome

    @property
    def time(self) -> np.ndarray:
        """Time in s."""
        return self.outcome.time

    @property
    def displacement(self) -> np.ndarray:
        """Displacement in m from the loaded rest state; NaN where the voltage is too low."""
        return self.outcome.sensed.displacement

    @property
    def standard_error(self) -> np.ndarray:
        """Standard error of the displacement in m."""
        return self.outcome.sensed.standard_error

    @property
    def sentences(self) -> tuple[str, ...]:
        """How large the error is, and what would reduce it."""
        return sense_texts(self.outcome)

    def plot(self) -> Figure:
        """Plot the voltage, and the displacement of the laser and of the film as its own sensor.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.
        """
        found = self.outcome
        return signal_figure(
            "actuator", found.time, found.voltage, found.laser, found.sensed.displacement
        )

    def _writers(self) -> Writers:
        return {
            ".csv": ("the rows", lambda out, overwrite: save_sensed(self.outcome, out, overwrite)),
            ".json": ("all numbers", lambda out, _: write_json(sense_json(self.outcome), out)),
        }

    def __repr__(self) -> str:
        """Return the recording and its rows in a line."""
        return f"<SenseResult {self.outcome.name!r}: {self.time.size} rows>"

    def _repr_html_(self) -> str:
        name = f"{self.outcome.name}: displacement from voltage and current"
        parts = [] if self.outcome.agreement is None else [drawing(self.plot(), name)]
        return card(name, *parts, sentences=sensed_texts(self.outcome))


@named_arguments
def sense(
    recording: Source,
    model: ModelSource,
    *,
    drive: str = "command",
    gain: float = 1.0,
    gain_error: float | None = None,
) -> SenseResult:
    """Compute the displacement from voltage and current alone, and compare it with the laser.

    Parameters
    ----------
    recording : recording or path
        A recording with a current, whose rows are means of conversions and whose voltage comes
        back to 0 V.
    model : model, result or path
        A ``Model``, a result that has one, or the path of a model file.
    drive : str
        Voltage: ``command`` or ``monitor``.
    gain : float
        Charge over that of the model, as the laser of another recording of this rig gave it.
    gain_error : float, optional
        Relative standard uncertainty of the gain; by default what the recording's rig file states
        of the scales and the film, and 1 % for each scale of which it states none.

    Returns
    -------
    SenseResult
        Time in s, displacement and its standard error in m, and how far the laser agrees.

    Raises
    ------
    InputError
        If the recording has no usable current, or is not of the model's film.

    Examples
    --------
    >>> import dearig
    >>> sensed = dearig.sense("run.h5", "model.toml")
    >>> sensed.standard_error  # in m
    """
    return SenseResult(
        sense_recording(
            recording, as_model_file(model), drive=drive, gain=gain, gain_error=gain_error
        )
    )
