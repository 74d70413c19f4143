"""A sequence before it is played: its voltage, what the model foresees, and what the gate says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.errors import InputError
from app.rigfile import RigFile
from app.sequencefile import LoadedSequence
from drivers.errors import RefusedWaveform
from drivers.gate import GatedWaveform, Prediction, admit
from model.actuator import Actuator, Drive
from model.errors import ModelError
from model.kinematics import thinning
from model.material import TABLE_3

__all__ = ["Plan", "plan"]


@dataclass(frozen=True)
class Plan:
    """A sequence on the rig's clock of ``rate`` Hz, N samples.

    ``time`` (N,) s, ``voltage`` (N,) V, and as the model foresees it ``displacement`` (N,) m and
    true ``field`` (N,) V/m, both NaN from where it cannot. ``waveform`` is what passed the gate, or
    None with the ``reasons``, one sentence each.
    """

    name: str
    rate: float
    time: np.ndarray
    voltage: np.ndarray
    displacement: np.ndarray
    field: np.ndarray
    waveform: GatedWaveform | None
    reasons: tuple[str, ...] = ()

    def admitted(self) -> GatedWaveform:
        """What may be played. Raises ``InputError`` with a sentence for every limit it breaks."""
        if self.waveform is None:
            raise InputError(
                f"sequence {self.name!r} is refused: {'; '.join(self.reasons)} "
                f"(limits of the rig file)"
            )
        return self.waveform


def plan(
    loaded: LoadedSequence, rig_file: RigFile, model: Actuator | None = None, film: str = ""
) -> Plan:
    """``loaded`` as the rig would play it, and whether it may.

    The film is foreseen with ``model``, by default that of the rig file's film with Table 3's
    network: a stretched film is thinner, and feels a higher field. ``film`` names the film that
    hangs there; the rig file's own, unless another is named. Raises ``InputError`` where the model
    cannot be asked at all (a film without a rest state).
    """
    rate, limits = float(rig_file.card.sample_rate_Hz), rig_file.gate_limits()
    film = film or rig_file.film.name
    name = loaded.sequence.name
    time, voltage = loaded.sample(rate)
    try:
        actuator = model or Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
        relaxed = actuator.film.capacitance(np.full(voltage.size, actuator.rest()))
    except ModelError as error:
        raise InputError(f"sequence {name!r} with this rig file: {error}") from error
    unknown = np.full(voltage.size, np.nan)
    # the film at its thickest: what is refused here needs no prediction, and what a voltage far
    # beyond every limit would do to the model is not the operator's question
    thick = np.full(voltage.size, 1.0 / actuator.film.thickness)
    try:
        admit(voltage, rate, limits, Prediction(thick, relaxed, film=film))
        response = actuator.simulate(Drive(time, voltage, hold=True))
    except RefusedWaveform as error:
        return Plan(name, rate, time, voltage, unknown, unknown, None, error.reasons)
    except ModelError as error:
        raise InputError(f"sequence {name!r} with this rig file: {error}") from error
    thin = thinning(actuator.film.held, response.stretch) / actuator.film.thickness
    displacement, field = response.displacement.copy(), np.abs(voltage) * thin
    failed = ""
    if not response.ok:
        displacement[response.reached :] = field[response.reached :] = np.nan
        failed = response.in_words
    prediction = Prediction(thin, actuator.film.capacitance(response.stretch), failed, film)
    try:
        waveform = admit(voltage, rate, limits, prediction)
    except RefusedWaveform as error:
        return Plan(name, rate, time, voltage, displacement, field, None, error.reasons)
    return Plan(name, rate, time, voltage, displacement, field, waveform)
