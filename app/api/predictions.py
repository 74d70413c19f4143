"""Predictions of a model, as arrays, tables, figures and files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis import simulate
from dearig.api.display import card, drawing, facts, write_page
from dearig.api.models import Model
from dearig.api.written import HasFiles, HasPage, Writers
from dearig.extras import import_extra
from dearig.recording.content.layout import UNITS
from dearig.recording.reading.origin import Origin
from dearig.report.figures.signals import signal_figure
from dearig.report.text.bands import band_texts
from dearig.report.text.numbers import seconds, significant
from dearig.report.text.sentences import pull_in_text
from dearig.units import SHOWN

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from dearig.analysis.readings.band import PredictionBand

__all__ = ["Prediction"]


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(HasFiles, HasPage):
    """Prediction of a model under a drive; arrays are (N,) in SI units.

    It is saved as ``.h5`` (a recording) or ``.csv`` (a table).

    Attributes
    ----------
    prediction : dearig.analysis.simulate.SimulatedRecord
        All values, with the highest true field in V/m and the static pull-in voltage in V.
    """

    prediction: simulate.SimulatedRecord

    @property
    def model(self) -> Model:
        """The model that was simulated."""
        return Model.of(self.prediction.model)

    @property
    def time(self) -> np.ndarray:
        """Time in s."""
        return self.prediction.values["time"]

    @property
    def drive(self) -> np.ndarray:
        """The voltage in V, or the stretch of a film."""
        actuator = self.prediction.kind == "actuator"
        return self.prediction.values["voltage_command" if actuator else "stretch"]

    @property
    def response(self) -> np.ndarray:
        """The displacement in m from the loaded rest state, or the nominal stress in Pa."""
        return self.prediction.response

    @property
    def band(self) -> PredictionBand | None:
        """The 95 % band of one reading and its parts; None where the model has no covariance.

        ``half_width`` and ``parameters`` are (N,), ``noise`` and ``law`` numbers, in m or Pa.
        """
        return self.prediction.band

    @property
    def low95(self) -> np.ndarray | None:
        """The lower end of the 95 % band (N,) in m or Pa; None where there is none."""
        return None if self.band is None else self.response - self.band.half_width

    @property
    def high95(self) -> np.ndarray | None:
        """The upper end of the 95 % band (N,) in m or Pa; None where there is none."""
        return None if self.band is None else self.response + self.band.half_width

    def to_pandas(self) -> DataFrame:
        """Return the values and the band as a data frame.

        Returns
        -------
        pandas.DataFrame
            A row for each sample over ``time`` in s; the units are in ``frame.attrs``.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        lib = import_extra("pandas", "notebook", "to_pandas")
        values = self.prediction.columns
        index = lib.Index(values.pop("time"), name="time")
        frame: DataFrame = lib.DataFrame(values, index=index)
        frame.attrs["units"] = {name: UNITS[name] for name in values}
        return frame

    def plot(self) -> Figure:
        """Plot the drive, and the predicted response with its band, over time.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.
        """
        return signal_figure(
            self.prediction.kind, self.time, self.drive, model=self.response, band=self.band
        )

    def _writers(self) -> Writers:
        def save(out: Path, overwrite: bool) -> Path:
            return simulate.save_prediction(self.prediction, out, overwrite)

        return {".h5": ("a recording", save), ".csv": ("a table", save)}

    def _write_page(self, path: Path) -> Path:
        return write_page(
            path, self.prediction.title, "Prediction", self._repr_html_(), (self._origin,)
        )

    @property
    def _origin(self) -> Origin:
        """The model, as the origin of these values."""
        source = f"prediction of the model {self.prediction.model.name}"
        return Origin(self.prediction.title, simulated=True, source=source)

    def __repr__(self) -> str:
        """Return title and size in a line."""
        return f"<Prediction {self.prediction.title!r}: {self.time.size} samples>"

    def _repr_html_(self) -> str:
        found, shown = self.prediction, SHOWN[self.prediction.kind]
        long = float(self.time[-1] - self.time[0])
        # what the solver leaves at rest is rounding, not a displacement
        rest = 1e-9 * float(np.ptp(self.response))
        ends = [float(f(self.response)) for f in (np.min, np.max)]
        span = [significant(end * shown.factor if abs(end) > rest else 0.0) for end in ends]
        rows = [
            ("samples", f"{self.time.size:,}, {seconds(long)}"),
            (shown.quantity.lower(), f"{span[0]} to {span[1]} {shown.unit}"),
        ]
        if found.field_max is not None:
            rows.append(("true field", f"up to {significant(found.field_max * 1e-6)} MV/m"))
            rows.append(("static pull-in", pull_in_text(found)))
        said = () if self.band is None else band_texts(self.band, found.kind)
        picture = drawing(self.plot(), f"{found.title} over time")
        return card(found.title, facts(rows), picture, sentences=said)
