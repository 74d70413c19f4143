"""Quality checks of recordings before they are used.

Faulty samples are masked with a small margin; the rest stays as it is. A recording that cannot be
used at all is refused with a sentence that says what is wrong and where.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dearig.analysis.readings.faults import clipped, gap_text, gaps, outliers, stuck, where
from dearig.analysis.readings.plausible import check_units
from dearig.errors import InputError
from dearig.model.readings.spikes import spikes
from dearig.recording.content.sign import sign_text
from dearig.recording.reading.recording import Recording

__all__ = ["Quality", "check_driven", "driven_by", "inspect"]

#: With fewer samples there are no statistics of a recording to compare a sample with.
_SAMPLES_MIN = 20
_MARGIN = 2  # samples on either side of a faulty one that are masked with it


@dataclass(frozen=True)
class Quality:
    """``valid`` (N,) is False where a reading must not be used, None where all are good.

    ``findings`` are sentences for the operator, each with sample and time.
    """

    valid: np.ndarray | None
    findings: tuple[str, ...]


def inspect(recording: Recording, moved: np.ndarray | None) -> Quality:
    """Check ``recording``, whose film was driven by ``moved`` (N,).

    Raises ``InputError`` for faults that no mask removes: a unit that is wrong by a thousand, a gap
    in which the film was driven, too few samples left.
    """
    signal, missing = recording.signal, recording.missing
    if moved is None or signal.size < _SAMPLES_MIN:
        # the fit refuses these with a better sentence
        return Quality(None if missing is None else ~missing, ())
    check_units(recording, moved)
    reversed_ = sign_text(recording.kind, moved, signal)
    findings = [*([reversed_] if reversed_ else []), *gaps(recording, moved)]
    # the film is pulled by the square of the voltage
    pull = moved if recording.kind == "film" else moved**2
    bad = np.zeros(signal.size, dtype=bool)
    if missing is not None:
        findings.append(gap_text(recording, missing))
        bad |= missing
    for what, runs in (
        ("the sensor is clipped", clipped(signal, pull)),
        ("the sensor is stuck", stuck(recording.time, signal, pull)),
        ("the reading drops out", outliers(signal, moved)),
    ):
        fresh = [(a, b) for a, b in runs if not bad[a:b].all()]
        if fresh:
            findings.append(where(recording, what, fresh))
        for a, b in fresh:
            bad[max(a - _MARGIN, 0) : b + _MARGIN] = True
    if recording.kind == "actuator":
        alone = spikes(recording.time, signal, pull, recording.quiet_samples) & ~bad
        if alone.any():
            places = [(int(i), int(i) + 1) for i in np.flatnonzero(alone)]
            what = "a single reading is far outside of the noise at rest"
            findings.append(where(recording, what, places))
            bad |= alone
    if not bad.any():
        return Quality(None, tuple(findings))
    if bad.mean() > 0.5:
        raise InputError(
            f"{recording.path}: {'; '.join(findings)}: less than half of it is usable; record it "
            f"again"
        )
    valid = ~bad
    valid.setflags(write=False)
    return Quality(valid, tuple(findings))


def driven_by(recording: Recording, drive: str) -> np.ndarray | None:
    """Return the drive of the film: the stretch, or the commanded or monitored voltage."""
    if recording.kind == "film":
        return recording.stretch
    if drive != "monitor":
        return recording.voltage_command
    monitor = recording.voltage_monitor
    if monitor is None:
        raise InputError(
            f"{recording.path} has no voltage monitor; use the commanded voltage", option="drive"
        )
    if gaps := int(np.count_nonzero(np.isnan(monitor))):
        raise InputError(
            f"{recording.path}: {gaps} of {monitor.size} readings of the voltage monitor are "
            f"missing, and what drove the film there is not known; use the commanded voltage",
            option="drive",
        )
    return monitor


def check_driven(recording: Recording, moved: np.ndarray | None) -> None:
    """Refuse to fit ``recording`` where ``moved`` (N,), its drive, never changes."""
    if moved is None or recording.samples < _SAMPLES_MIN:
        return  # the fit refuses these with a better sentence
    span = float(np.ptp(moved))
    if recording.kind == "film":
        if span == 0.0:
            raise InputError(
                f"{recording.path}: the stretch never changes from {moved[0]:.4g}; import the "
                f"column that holds the stretch, or record again"
            )
        return
    if span > recording.voltage_step and span > 0.0:
        return
    if float(np.max(np.abs(moved))) <= recording.voltage_step:
        raise InputError(
            f"{recording.path}: the voltage never leaves 0 V; check that the "
            f"amplifier was on and that the right column was imported"
        )
    raise InputError(
        f"{recording.path}: the voltage stands at {moved[0]:.4g} V throughout, and the film at "
        f"rest is not seen; start the recording before the voltage is applied"
    )
