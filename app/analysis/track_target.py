"""The target of a tracking on a rig: how it is sampled, and what of it can be reached."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.config.rigfile import RigFile
from dearig.config.targetfile import LoadedTarget
from dearig.errors import InputError
from dearig.model.control import Inversion, TrackingTask, Unreachable, VoltageLimits, invert
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Actuator

__all__ = [
    "SAMPLES_MAX",
    "WITHIN",
    "check_feasible",
    "lag_of",
    "limits_of",
    "missed_parts",
    "plan_target",
    "task_of",
]

#: Samples of a target at most: 17 min at 1 kHz. The inversion holds them, several times over.
SAMPLES_MAX = 1_000_000
#: Distance in m from a target that is accepted: a film rounds every corner by some micrometres.
WITHIN = 5e-6

_PARTS_SHOWN = 3  # of what is unreachable, in a sentence


def limits_of(rig_file: RigFile) -> VoltageLimits:
    """Return the limits within which a voltage is computed: those of the gate."""
    limits = rig_file.gate_limits()
    return VoltageLimits(limits.voltage_max, limits.slew, limits.field)


def task_of(target: LoadedTarget, rig_file: RigFile) -> TrackingTask:
    """Return the task of following ``target`` on the rig of ``rig_file``.

    Raises ``InputError`` for a target that is too long or too short for the sample rate.
    """
    rate = float(rig_file.card.sample_rate_Hz)
    if target.sequence.sequence.duration * rate > SAMPLES_MAX:
        raise InputError(
            f"target {target.name!r} lasts {target.sequence.sequence.duration:.4g} s, which is "
            f"more than {SAMPLES_MAX:,} samples at {rate:g} Hz: shorten it, or lower "
            f"card.sample_rate_Hz in the rig file"
        )
    _, wanted, lead_in, tail = target.sample(rate)
    if wanted.size - lead_in - tail < 4:
        raise InputError(f"target {target.name!r} has fewer than 4 samples at {rate:g} Hz")
    return TrackingTask(wanted, rate, limits_of(rig_file), lead_in, tail, lag_of(rig_file))


def plan_target(target: LoadedTarget, model: Actuator, rig_file: RigFile) -> Inversion:
    """Return the voltage of ``target`` for ``model``, and what the film can reach.

    Raises ``InputError`` for a target that is too long, and for a model that cannot be inverted.
    """
    try:
        return invert(model, task_of(target, rig_file))
    except ModelError as error:
        raise InputError(f"target {target.name!r}: {error}") from error


def missed_parts(unreachable: Sequence[Unreachable], within: float) -> list[Unreachable]:
    """Return the parts that the film misses by more than ``within`` m."""
    return [part for part in unreachable if part.worst > within]


def check_feasible(
    target: LoadedTarget, unreachable: Sequence[Unreachable], within: float = WITHIN
) -> None:
    """Raise ``InputError`` where the film misses ``target`` by more than ``within`` m.

    The sentence says when, why and by how much.
    """
    parts = missed_parts(unreachable, within)
    if parts:
        said = "; ".join(part.sentence for part in parts[:_PARTS_SHOWN])
        more = len(parts) - _PARTS_SHOWN
        raise InputError(
            f"target {target.name!r} cannot be reached: {said}"
            + (f" (and {more} more)" if more > 0 else "")
            + "; give another target, or follow the nearest feasible one",
            option="nearest",
        )


def lag_of(rig_file: RigFile) -> float:
    """Return by how much a reading is older than the sample at which it is recorded, in s.

    The model's voltage is held from row to row. With N = ``card.average`` conversions in a row the
    rig goes on a line from one value to the next, held from conversion to conversion: it is
    (1 - 1/N)/2 rows ahead of that. A reading is the mean about (1 - 1/N)/2 rows after the first.
    """
    inputs = [name for name in rig_file.terminals() if name != "voltage_command"]
    lag = rig_file.laser.delay - rig_file.skew(inputs.index("displacement"))
    card = rig_file.card
    return lag - (1.0 - 1.0 / card.average) / card.sample_rate_Hz
