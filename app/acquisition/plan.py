"""Plan of a run: the voltage, the predicted response, and the verdict of the gate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence
from dearig.drivers.errors import RefusedWaveform
from dearig.drivers.gate import GatedWaveform, Prediction, admit
from dearig.errors import InputError
from dearig.model.actuator import Actuator, Drive
from dearig.model.errors import ModelError
from dearig.model.kinematics import thinning
from dearig.model.material import TABLE_3

__all__ = ["Plan", "plan"]

# Hz; enough to predict a film with a period of milliseconds, at any rate of the clock; the field is
# still checked with every sample of the voltage
_PREDICTION_RATE = 5000.0


@dataclass(frozen=True)
class Plan:
    """A sequence on the rig's clock of ``rate`` Hz, N samples.

    ``voltage`` (N,) V. The prediction has one value for each ``stride`` samples, M in all:
    ``displacement`` (M,) m, the true ``field`` (M,) V/m at the highest voltage among them, both NaN
    from the sample at which the model fails. ``waveform`` has passed the gate,
    or is None with the ``reasons``, one sentence each.
    """

    name: str
    rate: float
    voltage: np.ndarray
    stride: int
    displacement: np.ndarray
    field: np.ndarray
    waveform: GatedWaveform | None
    reasons: tuple[str, ...] = ()

    @property
    def time(self) -> np.ndarray:
        """Time (M,) s of the prediction."""
        return np.arange(self.displacement.size) * (self.stride / self.rate)

    @property
    def displacement_of_samples(self) -> np.ndarray:
        """Displacement (N,) m of every sample, in single precision to save memory."""
        predicted = self.displacement.astype(np.float32)
        return np.repeat(predicted, self.stride)[: self.voltage.size]

    def admitted(self) -> GatedWaveform:
        """Return the waveform that may be played.

        Raises ``InputError`` with a sentence for every limit that the sequence breaks.
        """
        if self.waveform is None:
            raise InputError(
                f"sequence {self.name!r} is refused: {'; '.join(self.reasons)} "
                f"(limits of the rig file)"
            )
        return self.waveform


def plan(
    loaded: LoadedSequence, rig_file: RigFile, model: Actuator | None = None, film: str = ""
) -> Plan:
    """Plan ``loaded`` as the rig would play it, and check it with the gate.

    The response is predicted with ``model``, by default that of the rig file's film with Table 3's
    network: a stretched film is thinner, so its field is higher. ``film`` names the film on the
    rig, by default the rig file's. Raises ``InputError`` where the model cannot be simulated at all
    (a film without a rest state).
    """
    rate, limits = float(rig_file.card.sample_rate_Hz), rig_file.gate_limits()
    film = film or rig_file.film.name
    name = loaded.sequence.name
    voltage = loaded.sample(rate)[1]
    stride = max(1, math.floor(rate / _PREDICTION_RATE))
    peaks = _peaks(voltage, stride)
    unknown = np.full(peaks.size, np.nan)
    try:
        actuator = model or Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
        actuator.rest()
        volume = actuator.film.electric_volume
        # the film at its thickest: a sequence that is refused here needs no prediction, and a
        # voltage far beyond every limit would only make the model fail
        thick = np.full(peaks.size, 1.0 / actuator.film.thickness)
        admit(voltage, rate, limits, Prediction(thick, volume, film=film, stride=stride))
        time = np.arange(peaks.size) * (stride / rate)
        response = actuator.simulate(Drive(time, peaks, hold=True))
    except RefusedWaveform as error:
        return Plan(name, rate, voltage, stride, unknown, unknown, None, error.reasons)
    except ModelError as error:
        raise InputError(f"sequence {name!r} with this rig file: {error}") from error
    thin = thinning(actuator.film.held, response.stretch) / actuator.film.thickness
    displacement, field = response.displacement.copy(), np.abs(peaks) * thin
    failed = ""
    if not response.ok:
        displacement[response.reached :] = field[response.reached :] = np.nan
        failed = response.in_words
    prediction = Prediction(thin, volume, failed, film, stride)
    try:
        waveform = admit(voltage, rate, limits, prediction)
    except RefusedWaveform as error:
        return Plan(name, rate, voltage, stride, displacement, field, None, error.reasons)
    return Plan(name, rate, voltage, stride, displacement, field, waveform)


def _peaks(voltage: np.ndarray, stride: int) -> np.ndarray:
    """Return the sample farthest from 0 V of each ``stride`` samples of ``voltage`` (N,)."""
    if stride == 1:
        return voltage
    whole = voltage.size // stride * stride
    groups = voltage[:whole].reshape(-1, stride)
    high, low = groups.max(axis=1), groups.min(axis=1)
    peaks = np.where(high >= -low, high, low)
    rest = voltage[whole:]
    return np.append(peaks, rest[np.argmax(np.abs(rest))]) if rest.size else peaks
