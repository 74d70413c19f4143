"""Bands on predictions: what a fit knows of the errors of its model, and what follows from it.

A model file carries the covariance of its fitted parameters, the noise of a reading, the error that
the model's equations left on recordings, and what the training recordings have shown.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dearig.analysis.cores import for_simulations
from dearig.config.modelfile import COVARIANCE, PREDICTION, ModelFile
from dearig.model.readings.measures import root_mean_square
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.strip import Strip
from dearig.units import SHOWN

if TYPE_CHECKING:
    # these import SciPy, which commands that fit nothing do without
    from dearig.analysis.outcomes import Comparison, Evaluation
    from dearig.analysis.readings.record import Readings
    from dearig.model.diagnosis.excitation import Beyond, PredictedRun, TrainingRange
    from dearig.model.diagnosis.results import Stage

__all__ = [
    "TRAINING",
    "VALIDATION",
    "PredictionBand",
    "band_of",
    "covariance_of",
    "judged_with_bands",
    "motion_of",
    "prediction_table",
    "with_bands",
]

log = logging.getLogger(__name__)

#: Recordings that the error of the law is from.
VALIDATION, TRAINING = "validation", "training"


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """Standard deviations in m or Pa of what a model predicts; the parts are independent.

    ``parameters`` (N,) is the part of the fitted parameters' errors, ``noise`` that of one reading,
    ``law`` that of the model's equations, and ``zero`` that of a recording's zero. ``law`` is from
    the recordings ``law_from``, which are ``law_of`` ``validation`` or ``training``, "" where it is
    not known. ``beyond`` is where the drive goes beyond what the training recordings have shown,
    None where it does not, or where that is not known.
    """

    parameters: np.ndarray
    noise: float
    law: float
    law_of: str = ""
    law_from: tuple[str, ...] = ()
    zero: float = 0.0
    beyond: Beyond | None = None

    @property
    def half_width(self) -> np.ndarray:
        """Half of the 95 % band (N,) of one reading."""
        rest = self.noise**2 + self.law**2 + self.zero**2
        return np.asarray(_normal_95() * np.sqrt(self.parameters**2 + rest))

    def of_means(self, readings: int) -> np.ndarray:
        """Return half of the 95 % band (N // readings,) of means of so many neighbours.

        Noise is independent from reading to reading. The other parts are not: they stay as large as
        they are on average.
        """
        count = self.parameters.size // readings
        parameters = self.parameters[: count * readings].reshape(count, readings).mean(axis=1)
        rest = self.noise**2 / readings + self.law**2 + self.zero**2
        return np.asarray(_normal_95() * np.sqrt(parameters**2 + rest))

    @property
    def parameters_rms(self) -> float:
        """The RMS of the part of the parameters over the recording."""
        return root_mean_square(self.parameters)

    def inside(self, error: np.ndarray) -> float:
        """Return the share of the readings whose ``error`` (N,) is inside; NaN is not a reading."""
        good = np.isfinite(error)
        return float(np.mean(np.abs(error[good]) <= self.half_width[good]))


def _normal_95() -> float:
    from dearig.model.fitting.parameters import NORMAL_95

    return NORMAL_95


# ---------------------------------------------------------------- what a model file carries


def prediction_table(
    train: Sequence[Comparison], validation: Sequence[Comparison], noise: float
) -> dict[str, Any]:
    """Return what the fit knows of its model's predictions, for the history of a model file.

    ``noise`` in m or Pa is that of the training recordings. What the parameters explain of the
    errors on ``validation`` is that of its bands, where it has them.
    """
    kind = train[0].kind
    shown = SHOWN[kind]
    judged = validation or train
    table: dict[str, Any] = {
        f"noise_{shown.suffix}": noise * shown.error_factor,
        "law_error_pct": 100.0 * _law_error(judged, noise),
        "law_error_of": VALIDATION if validation else TRAINING,
        "law_error_from": [c.name for c in judged],
    }
    if kind == "actuator":
        from dearig.model.diagnosis.excitation import shown_by

        seen = shown_by([motion_of(c, noise) for c in train])
        table["shown"] = {
            "voltage_kV": seen.voltage * 1e-3,
            "displacement_um": [seen.low * 1e6, seen.high * 1e6],
            "edges_Hz": seen.edges.tolist(),
            "energies_over_noise": seen.energies.tolist(),
        }
    return table


def _law_error(comparisons: Sequence[Comparison], noise: float) -> float:
    """Return the error that the equations leave, over the RMS of the response, of all together."""
    squares = []
    for c in comparisons:
        explained = max(c.noise or 0.0, noise) ** 2
        explained += 0.0 if c.band is None else c.band.parameters_rms**2
        response = root_mean_square(c.model)
        if math.isfinite(c.errors.rms) and response > 0.0:
            squares.append(max(c.errors.rms**2 - explained, 0.0) / response**2)
    return math.sqrt(sum(squares) / len(squares)) if squares else 0.0


def motion_of(comparison: Comparison, noise: float) -> PredictedRun:
    """Return the motion of the model under a recording; ``noise`` is at least that of a reading."""
    return _motion(
        comparison.name, comparison.time, comparison.drive, comparison.model,
        max(comparison.noise or 0.0, noise),
    )  # fmt: skip


def _motion(
    name: str, time: np.ndarray, drive: np.ndarray, response: np.ndarray, noise: float
) -> PredictedRun:
    from dearig.model.diagnosis.excitation import PredictedRun

    step = float(np.median(np.diff(time)))
    return PredictedRun(name, step, np.nan_to_num(drive), response, noise)


def covariance_of(model: ModelFile) -> tuple[tuple[str, ...], np.ndarray] | None:
    """Return names and covariance (f, f) of the fitted parameters of ``model``, in SI units.

    None where its file has none, or one that is not of its parameters.
    """
    from dearig.model.fitting.parameters import FitLayout

    table = model.history.get(COVARIANCE)
    if not isinstance(table, Mapping):
        return None
    try:
        names = tuple(str(name) for name in table["names"])
        matrix = np.array(table["matrix"], dtype=np.float64)
    except (KeyError, TypeError, ValueError) as error:
        log.info("the covariance of the model %r is of no use: %s", model.name, error)
        return None
    known = set(FitLayout(model.model).names)
    # a model that predicts has no drift of the recordings that were fitted
    places = [i for i, name in enumerate(names) if name in known]
    if matrix.shape != (len(names), len(names)) or not np.isfinite(matrix).all() or not places:
        log.info("the covariance of the model %r is not that of its parameters", model.name)
        return None
    return tuple(names[i] for i in places), matrix[np.ix_(places, places)]


@dataclass(frozen=True, eq=False)
class _Known:
    """What a model file says of the errors of its predictions: ``prediction_table``, in SI."""

    noise: float
    law: float
    law_of: str
    law_from: tuple[str, ...]
    shown: TrainingRange | None


def _known(model: ModelFile) -> _Known:
    """Return what the file of ``model`` says; nothing where it does not."""
    suffix = SHOWN[model.kind].suffix
    table = model.history.get(PREDICTION)
    nothing = _Known(0.0, 0.0, "", (), None)
    if not isinstance(table, Mapping):
        return nothing
    try:
        return _Known(
            _size(table[f"noise_{suffix}"]) / SHOWN[model.kind].error_factor,
            _size(table["law_error_pct"]) / 100.0,
            str(table["law_error_of"]),
            tuple(str(name) for name in table["law_error_from"]),
            _shown(table["shown"]) if "shown" in table else None,
        )
    except (KeyError, TypeError, ValueError) as error:
        log.info("what the model %r says of its predictions is of no use: %s", model.name, error)
        return nothing


def _size(value: Any) -> float:
    size = float(value)
    if not (math.isfinite(size) and size >= 0.0):
        raise ValueError(f"{value!r} is not a size")
    return size


def _shown(table: Mapping[str, Any]) -> TrainingRange:
    from dearig.model.diagnosis.excitation import TrainingRange

    edges, energies = (
        np.array([_size(v) for v in table[name]]) for name in ("edges_Hz", "energies_over_noise")
    )
    low, high = (float(v) * 1e-6 for v in table["displacement_um"])
    if edges.size != energies.size + 1 or np.any(np.diff(edges) <= 0.0) or not low <= high:
        raise ValueError("the bands that training has shown do not go together")
    return TrainingRange(edges, energies, _size(table["voltage_kV"]) * 1e3, low, high)


# ---------------------------------------------------------------- bands


@for_simulations()
def band_of(
    model: ModelFile,
    driven: Drive | tuple[np.ndarray, np.ndarray],
    response: np.ndarray,
    *,
    kinematics: str = "uniaxial",
) -> PredictionBand | None:
    """Return the band of the ``response`` (N,) that ``model`` predicts; None without a covariance.

    ``driven`` is the voltage, or time and stretch (N,) of a film under ``kinematics``.
    """
    one = 1.0  # noise of the record, which the deviation does not depend on
    record: Record
    moving: Actuator | Strip = model.model
    if isinstance(driven, Drive):
        record, drive = ActuatorRecord("", driven, response, one), driven.voltage
    else:
        time, drive = driven
        record = FilmRecord("", time, drive, response, one)
        strip = moving if isinstance(moving, Strip) else Strip(moving.network)
        moving = replace(strip, kinematics=kinematics)
    return _band(model, moving, record, drive, response, None)


def _band(
    model: ModelFile,
    moving: Actuator | Strip,
    record: Record,
    drive: np.ndarray,
    response: np.ndarray,
    before: PredictionBand | None,
) -> PredictionBand | None:
    """Return the band of a ``response``; ``before`` is one by the same parameters, if any."""
    fitted = covariance_of(model)
    if fitted is None:
        return None
    from dearig.model.fitting.prediction import parameter_deviation

    known = _known(model)
    parameters = (
        parameter_deviation(record, moving, *fitted) if before is None else before.parameters
    )
    beyond = None
    if known.shown is not None and isinstance(record, ActuatorRecord) and known.noise > 0.0:
        asked = _motion(record.name, record.time, drive, response, known.noise)
        beyond = known.shown.beyond(asked)
    return PredictionBand(
        parameters,
        known.noise,
        known.law * root_mean_square(response),
        known.law_of,
        known.law_from,
        beyond=beyond,
    )


@for_simulations()
def with_bands(
    comparisons: Sequence[Comparison], readings: Sequence[Readings], model: ModelFile
) -> tuple[Comparison, ...]:
    """Return ``comparisons`` of ``readings`` with the bands of their predictions by ``model``.

    The noise is that of the recording, where it is known. Comparisons that have bands already have
    them by the same parameters. Without where the model file has no covariance.
    """
    by_name = {each.name: each for each in readings}
    found = []
    for c in comparisons:
        each = by_name[c.name]
        moving = model.model
        if isinstance(moving, Strip):
            moving = replace(moving, kinematics=each.recording.kinematics)
        band = _band(model, moving, each.record, c.drive, c.model, c.band)
        if band is not None:
            noise = c.noise if c.noise is not None else band.noise
            count = each.lead_in if c.kind == "actuator" else 0
            zero = noise / math.sqrt(count) if count else 0.0
            band = replace(band, noise=noise, zero=zero)
        found.append(replace(c, band=band))
    return tuple(found)


def judged_with_bands(
    stand: Evaluation, readings: Sequence[Readings], stage: Stage, history: Mapping[str, Any]
) -> Evaluation:
    """Return ``stand`` with the bands of what the model of ``stage`` predicts of ``readings``.

    ``history`` is that of its file; without, the bands are of its parameters alone.
    """
    from dearig.analysis.outcomes import covariance_table

    covariance = covariance_table(stage.covariance_names, stage.covariance)
    model = ModelFile("", stage.predicting, {COVARIANCE: covariance, **history})
    return replace(stand, validation=with_bands(stand.validation, readings, model))
