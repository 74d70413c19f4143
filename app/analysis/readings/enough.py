"""Whether recordings are enough: to fit, to predict others from, and apart from each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dearig.errors import InputError
from dearig.recording.reading.recording import Recording

if TYPE_CHECKING:
    # it imports the filters of SciPy, which a run does without
    from dearig.analysis.readings.record import Readings

__all__ = ["check_enough", "extrapolated", "few_data", "overlap"]

#: s under voltage below which data are few: the longest relaxation time of the thesis's Table 3.
_FEW_SECONDS = 8.4
#: Loadings below which data are few: with two, the first and a later one differ or not; with three,
#: the later ones can be compared with each other.
_FEW_LOADINGS = 3
_FEW_SAMPLES = 300  # of a film: three times what ``check_enough`` refuses
_RUN = 40  # samples that have to agree: an excerpt of another recording
_PROBES = 60  # places at which such an excerpt is looked for
_DRIVE_RATIO = 1.05  # of the largest drive to that of the training data: extrapolation from here
_DURATION_RATIO = 3.0  # the same for the duration


def check_enough(readings: Sequence[Readings]) -> None:
    """Refuse readings that together are too short to distinguish effects.

    3 s and 200 samples under voltage, or 100 samples of film data, are the least that can hold a
    few lobes and relaxation times.
    """
    first = readings[0].recording
    if first.kind == "film":
        samples = sum(r.recording.samples for r in readings)
        if samples < 100:
            raise InputError(
                f"{first.path}: {samples} samples are too few to tell one effect from "
                f"another; give at least 100"
            )
        return
    driven, samples = 0.0, 0
    for each in readings:
        recording, moved = each.recording, each.moved_by
        if moved is None:
            continue
        on = np.flatnonzero(np.abs(moved) > 0.02 * float(np.max(np.abs(moved))))
        if on.size:
            driven += float(recording.time[-1] - recording.time[on[0]])
            samples += int(recording.samples - on[0])
    if driven < 3.0 or samples < 200:
        raise InputError(
            f"{first.path}: {driven:.3g} s and {samples} samples from the first voltage on "
            f"are too few to tell one effect from another; give recordings of several lobes, with "
            f"at least 3 s and 200 samples in all"
        )


def few_data(readings: Sequence[Readings]) -> str:
    """Return how few data ``readings`` hold in all, as "4.2 s under voltage, 2 loadings".

    Empty where there are enough: loadings to compare with each other, and a time in which slow
    relaxation shows.
    """
    seconds, loadings, samples = 0.0, 0, 0
    for each in readings:
        recording, moved = each.recording, each.moved_by
        if moved is None or moved.size == 0:
            continue
        pull = np.abs(moved - 1.0 if recording.kind == "film" else moved)
        high = pull > 0.5 * float(pull.max())
        loadings += int(np.count_nonzero(high[1:] & ~high[:-1]))
        samples += moved.size
        on = np.flatnonzero(pull > 0.02 * float(pull.max()))
        if on.size:
            seconds += float(recording.time[on[-1]] - recording.time[on[0]])
    times = f"{loadings} loading{'' if loadings == 1 else 's'}"
    if readings[0].kind == "film":
        return f"{samples} samples, {times}" if samples < _FEW_SAMPLES else ""
    if seconds >= _FEW_SECONDS and loadings >= _FEW_LOADINGS:
        return ""
    return f"{seconds:.3g} s under voltage, {times}"


def overlap(one: Recording, two: Recording) -> tuple[float, float] | None:
    """Return the times in s, in ``one`` and ``two``, where equal measured values begin, or None.

    Two runs never have the same noise, so a row of equal values is an excerpt of the other. Runs
    that this program recorded at two times are two runs: a simulated rig may repeat its noise.
    """
    if _is_run(one) and _is_run(two) and _began(one) != _began(two):
        return None
    a, b = one.signal, two.signal
    span = float(np.ptp(b))
    if a.size < _RUN or b.size < _RUN or span == 0.0:
        return None
    close = 1e-7 * span  # what a decimal file rounds off
    windows = np.linspace(0, b.size - _RUN, min(_PROBES, b.size - _RUN + 1)).astype(int)
    for start in windows:
        row = b[start : start + _RUN]
        if np.ptp(row) < 1e-3 * span or np.unique(row).size < _RUN // 4:
            continue  # rest, or a hold without noise, is alike in every recording
        at = np.flatnonzero(np.abs(a[: a.size - _RUN + 1] - row[0]) <= close)
        for k in range(1, _RUN):
            at = at[np.abs(a[at + k] - row[k]) <= close]
            if at.size == 0:
                break
        if at.size:
            return float(one.time[at[0]]), float(two.time[start])
    return None


def extrapolated(train: Sequence[Readings], others: Sequence[Readings]) -> tuple[str, ...]:
    """Return sentences on ``others`` with a larger drive or a much longer duration than ``train``.

    The model was not fitted there, so its error is that of an extrapolation.
    """
    largest = max(_largest_drive(r) for r in train)
    longest = max(float(np.ptp(r.recording.time)) for r in train)
    found = []
    for each in others:
        said: list[str] = []
        recording = each.recording
        far, long = _largest_drive(each), float(np.ptp(recording.time))
        if recording.kind == "film" and far - 1.0 > _DRIVE_RATIO * (largest - 1.0):
            said.append(f"goes to a stretch of {far:.3g}, those that were fitted to {largest:.3g}")
        elif recording.kind != "film" and far > _DRIVE_RATIO * largest:
            said.append(
                f"goes to {far / 1e3:.3g} kV, those that were fitted to {largest / 1e3:.3g} kV"
            )
        if long > _DURATION_RATIO * longest:
            said.append(f"lasts {long:.0f} s, those that were fitted {longest:.0f} s at most")
        if said:
            found.append(f"{recording.name} {'; and '.join(said)}: its error is extrapolated")
    return tuple(found)


def _largest_drive(readings: Readings) -> float:
    """Return the largest stretch, or the highest voltage in V."""
    moved = readings.moved_by
    return 0.0 if moved is None else float(np.nanmax(np.abs(moved)))


def _is_run(recording: Recording) -> bool:
    return bool(recording.channels)


def _began(recording: Recording) -> object:
    return recording.provenance.get("start_time")
