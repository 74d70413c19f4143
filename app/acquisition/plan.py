"""Plan of a run: the voltage, the predicted response, and the verdict of the gate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dearig.acquisition.prediction import PredictedFilm
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence
from dearig.drivers.errors import RefusedWaveform
from dearig.drivers.gate import BlockGate, GatedWaveform, admit, open_block_gate
from dearig.drivers.samples import Repeated, Samples
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet

__all__ = ["Plan", "correctable", "plan"]


@dataclass(frozen=True)
class Plan:
    """A sequence on the rig's clock of ``rate`` Hz, N samples.

    ``voltage`` in V is computed window by window and never held whole. The prediction has one value
    for each ``stride`` samples, M in all, in single precision: ``displacement`` (M,) m, the true
    ``field`` (M,) V/m at the highest voltage among them. Both are NaN from the sample at which the
    model fails, or at which the voltage exceeds its limit. ``waveform`` has passed the gate, or is
    None with the ``reasons``, one sentence each. Every ``average`` samples are one row of the
    recording.
    """

    name: str
    rate: float
    voltage: Samples
    stride: int
    displacement: np.ndarray
    field: np.ndarray
    waveform: GatedWaveform | None
    reasons: tuple[str, ...] = ()
    average: int = 1

    @property
    def rows(self) -> int:
        """Number of rows of the recording, each the mean of ``average`` samples."""
        return self.samples // self.average

    @property
    def samples(self) -> int:
        """Number of samples, N."""
        return self.voltage.samples

    @property
    def duration(self) -> float:
        """Time in s from the first to the last sample."""
        return (self.samples - 1) / self.rate

    @property
    def displacement_of_samples(self) -> Samples:
        """Displacement in m of every sample, read window by window."""
        return Repeated(self.displacement, self.stride, self.samples)

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
    loaded: LoadedSequence,
    rig_file: RigFile,
    model: Actuator | None = None,
    film: str = "",
    progress: Progress = quiet,
    observe: Callable[[int, np.ndarray], None] | None = None,
) -> Plan:
    """Plan ``loaded`` as the rig would play it, and check it with the gate.

    The rig's clock runs at the rate of conversions: every step that the output makes is checked.

    The response is predicted with ``model``, by default that of the rig file's film with Table 3's
    network: a stretched film is thinner, so its field is higher. ``film`` names the film on the
    rig, by default the rig file's. ``progress`` may raise an exception to end the planning.
    ``observe`` is called once with each piece of the voltage: its first sample, and (n,) V.

    Raises ``InputError`` where the model cannot be simulated at all (a film without a rest state).
    """
    rate, limits = rig_file.card.conversion_rate_Hz, rig_file.gate_limits()
    name, voltage = loaded.sequence.name, loaded.on_clock(rate)
    film = film or rig_file.film.name
    waveform: GatedWaveform | None = None
    reasons: tuple[str, ...] = ()
    try:
        actuator = _planned_film(rig_file, model)
        response = PredictedFilm(actuator, voltage.samples, rate, limits, film, observe)
        waveform = admit(voltage, rate, limits, response, lambda part: progress("planning", part))
    except RefusedWaveform as error:
        reasons = error.reasons
    except ModelError as error:
        raise InputError(f"sequence {name!r} with this rig file: {error}") from error
    return Plan(
        name, rate, voltage, response.stride, response.displacement, response.field, waveform,
        reasons, rig_file.card.average,
    )  # fmt: skip


def correctable(
    planned: Plan,
    rig_file: RigFile,
    model: Actuator | None = None,
    film: str = "",
    *,
    block: int,
    authority: float,
    rate_limit: float,
    progress: Progress = quiet,
) -> BlockGate:
    """Return the gate through which ``planned`` is corrected while it is played.

    ``block`` is the least number of samples that are corrected together, see ``open_block_gate``;
    ``model`` and ``film`` are those of ``plan``. Raises ``InputError`` where the limits leave no
    room for the ``authority``.
    """
    waveform = planned.admitted()
    film = film or rig_file.film.name
    actuator = _planned_film(rig_file, model)

    def predicted() -> PredictedFilm:
        return PredictedFilm(
            actuator, waveform.samples, waveform.rate, waveform.limits, film, keeps=False
        )

    try:
        return open_block_gate(
            waveform, block=-(-block // planned.stride) * planned.stride, authority=authority,
            rate_limit=rate_limit, edge=predicted(), prediction=predicted(),
            progress=lambda part: progress("planning", part),
        )  # fmt: skip
    except RefusedWaveform as error:
        raise InputError(
            f"{planned.name!r} cannot be corrected by {authority:.3g} of its voltage: "
            f"{'; '.join(error.reasons)} (limits of the rig file): lower the authority or the "
            f"voltage"
        ) from error


def _planned_film(rig_file: RigFile, model: Actuator | None) -> Actuator:
    return model or Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
