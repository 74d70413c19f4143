"""Quality checks of recordings before they are used.

Faulty samples are masked with a small margin; the rest stays as it is. A recording that cannot be
used at all is refused with a sentence that says what is wrong and where.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dearig.errors import InputError
from dearig.model.film.material import THESIS_FILM, VACUUM_PERMITTIVITY, Film
from dearig.model.readings.records import interpolated
from dearig.model.readings.spikes import RINGING, spikes
from dearig.recording.reading.recording import Recording

__all__ = [
    "Quality",
    "check_enough",
    "driven_by",
    "extrapolated",
    "few_data",
    "inspect",
    "overlap",
    "spikes_about",
]

#: With fewer samples there are no statistics of a recording to compare a sample with.
_SAMPLES_MIN = 20
#: Pa; a modulus in the middle of the range of elastomers, 1e4 to 1e7 Pa.
_MODULUS = 1e5
_DRIVE_RATIO = 1.05  # of the largest drive to that of the training data: extrapolation from here
_DURATION_RATIO = 3.0  # the same for the duration
_MARGIN = 2  # samples on either side of a faulty one that are masked with it


@dataclass(frozen=True)
class Quality:
    """``valid`` (N,) is False where a reading must not be used, None where all are good.

    ``findings`` are sentences for the operator, each with sample and time.
    """

    valid: np.ndarray | None
    findings: tuple[str, ...]


def inspect(recording: Recording, drive: str = "command", *, to_fit: bool = True) -> Quality:
    """Check ``recording``, whose film ``drive`` (command or monitor) moved.

    Raises ``InputError`` for faults that no mask removes: a unit that is wrong by a thousand, a gap
    in which the film was driven, too few samples left; with ``to_fit`` also a constant drive.
    """
    signal = recording.signal
    moved = driven_by(recording, drive)
    if moved is None or signal.size < _SAMPLES_MIN:
        return Quality(None, ())  # the fit refuses these with a better sentence
    if to_fit:
        _check_driven(recording, moved)
    _check_units(recording, moved)
    findings = list(_gaps(recording, moved))
    # the film is pulled by the square of the voltage
    pull = moved if recording.kind == "film" else moved**2
    bad = np.zeros(signal.size, dtype=bool)
    for what, runs in (
        ("the sensor is clipped", _clipped(signal, pull)),
        ("the sensor is stuck", _stuck(recording.time, signal, pull)),
        ("the reading drops out", _outliers(signal, moved)),
    ):
        fresh = [(a, b) for a, b in runs if not bad[a:b].all()]
        if fresh:
            findings.append(_where(recording, what, fresh))
        for a, b in fresh:
            bad[max(a - _MARGIN, 0) : b + _MARGIN] = True
    if recording.kind == "actuator":
        alone = spikes(recording.time, signal, pull, recording.quiet_samples) & ~bad
        if alone.any():
            places = [(int(i), int(i) + 1) for i in np.flatnonzero(alone)]
            what = "a single reading is far outside of the noise at rest"
            findings.append(_where(recording, what, places))
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


def spikes_about(
    recording: Recording, residual: np.ndarray, usable: np.ndarray, pull: np.ndarray
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return which readings (N,) are spikes about a model, and a sentence on them.

    ``residual`` (N,) is measured less model, ``pull`` (N,) what moves the film. Where the film
    rings, only a model tells a spike from its motion.
    """
    if recording.noise is None or recording.noise.step:
        return np.zeros_like(usable), ()
    left = interpolated(recording.time, residual, usable)
    found = spikes(recording.time, left, pull, recording.quiet_samples) & usable
    if not found.any():
        return found, ()
    places = [(int(i), int(i) + 1) for i in np.flatnonzero(found)]
    return found, (_where(recording, "a single reading is far off the model", places),)


def check_enough(recordings: Sequence[Recording], drive: str = "command") -> None:
    """Refuse recordings that together are too short to distinguish effects.

    3 s and 200 samples under voltage, or 100 samples of film data, are the least that can hold a
    few lobes and relaxation times.
    """
    if recordings[0].kind == "film":
        samples = sum(r.samples for r in recordings)
        if samples < 100:
            raise InputError(
                f"{recordings[0].path}: {samples} samples are too few to tell one effect from "
                f"another; give at least 100"
            )
        return
    driven, samples = 0.0, 0
    for recording in recordings:
        moved = driven_by(recording, drive)
        if moved is None:
            continue
        on = np.flatnonzero(np.abs(moved) > 0.02 * float(np.max(np.abs(moved))))
        if on.size:
            driven += float(recording.time[-1] - recording.time[on[0]])
            samples += int(recording.samples - on[0])
    if driven < 3.0 or samples < 200:
        raise InputError(
            f"{recordings[0].path}: {driven:.3g} s and {samples} samples from the first voltage on "
            f"are too few to tell one effect from another; give recordings of several lobes, with "
            f"at least 3 s and 200 samples in all"
        )


#: s under voltage below which data are few: the longest relaxation time of the thesis's Table 3.
_FEW_SECONDS = 8.4
#: Loadings below which data are few: with two, the first and a later one differ or not; with three,
#: the later ones can be compared with each other.
_FEW_LOADINGS = 3
_FEW_SAMPLES = 300  # of a film: three times what ``check_enough`` refuses


def few_data(recordings: Sequence[Recording], drive: str = "command") -> str:
    """Return how few data ``recordings`` hold in all, as "4.2 s under voltage, 2 loadings".

    Empty where there are enough: loadings to compare with each other, and a time in which slow
    relaxation shows.
    """
    seconds, loadings, samples = 0.0, 0, 0
    for recording in recordings:
        moved = driven_by(recording, drive)
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
    if recordings[0].kind == "film":
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


_RUN = 40  # samples that have to agree
_PROBES = 60


def extrapolated(
    train: Sequence[Recording], others: Sequence[Recording], drive: str = "command"
) -> tuple[str, ...]:
    """Return sentences on ``others`` with a larger drive or a much longer duration than ``train``.

    The model was not fitted there, so its error is that of an extrapolation.
    """
    largest = max(_largest_drive(r, drive) for r in train)
    longest = max(float(np.ptp(r.time)) for r in train)
    found = []
    for recording in others:
        said = []
        far, long = _largest_drive(recording, drive), float(np.ptp(recording.time))
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


def _largest_drive(recording: Recording, drive: str) -> float:
    """The largest stretch, or the highest voltage in V."""
    moved = driven_by(recording, drive)
    return 0.0 if moved is None else float(np.nanmax(np.abs(moved)))


def _is_run(recording: Recording) -> bool:
    return bool(recording.channels)


def _began(recording: Recording) -> object:
    return recording.provenance.get("start_time")


def driven_by(recording: Recording, drive: str) -> np.ndarray | None:
    """Return the drive of the film: the stretch, or the commanded or monitored voltage."""
    if recording.kind == "film":
        return recording.stretch
    if drive != "monitor":
        return recording.voltage_command
    if recording.voltage_monitor is None:
        raise InputError(
            f"{recording.path} has no voltage monitor; leave --drive out to use the command"
        )
    return recording.voltage_monitor


# ---------------------------------------------------------------- refused


def _check_driven(recording: Recording, moved: np.ndarray) -> None:
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


def _check_units(recording: Recording, moved: np.ndarray) -> None:
    if recording.kind == "film":
        _check_film_units(recording, moved)
        return
    peak = float(np.max(np.abs(moved)))
    if peak == 0.0:
        return
    at = f"at {_place(recording, int(np.argmax(np.abs(moved))))}"
    if peak > 1e5:
        raise InputError(
            f"{recording.path}: the voltage reaches {peak * 1e-3:.4g} kV {at}, which no film "
            f"survives; is it in mV, and was it imported as V or kV?"
        )
    if peak < 30.0:
        raise InputError(
            f"{recording.path}: the voltage reaches only {peak:.4g} V {at}, which moves no film; "
            f"is it in kV, and was it imported as V?"
        )
    film = recording.film or THESIS_FILM
    # the 99.9 % range: a single outlier is not taken for a wrong unit
    travel = float(np.subtract(*np.percentile(recording.signal, (99.95, 0.05))))
    expected = _expected_travel(film, peak)
    if travel > 100.0 * expected and travel > 1e-3 * film.length:
        raise InputError(
            f"{recording.path}: the displacement spans {travel * 1e3:.4g} mm under "
            f"{peak * 1e-3:.4g} kV, where a film of {film.length * 1e3:.4g} mm moves about "
            f"{expected * 1e3:.2g} mm; is its unit wrong by a thousand, or the voltage's?"
        )
    if expected > 100e-6 and 0.0 < travel < 3e-3 * expected:
        raise InputError(
            f"{recording.path}: the displacement spans only {travel * 1e6:.4g} um under "
            f"{peak * 1e-3:.4g} kV, where a film of {film.length * 1e3:.4g} mm moves about "
            f"{expected * 1e3:.2g} mm; is its unit wrong by a thousand, or the voltage's?"
        )


def _expected_travel(film: Film, voltage: float) -> float:
    """Return the displacement in m: the Maxwell stress over a modulus in the usual range."""
    stress = VACUUM_PERMITTIVITY * film.permittivity * (voltage / film.thickness) ** 2
    return min(stress / _MODULUS, 3.0) * film.length


def _check_film_units(recording: Recording, stretch: np.ndarray) -> None:
    low, high = float(stretch.min()), float(stretch.max())
    at = f"at {_place(recording, int(np.argmax(stretch)))}"
    if high > 20.0:
        raise InputError(
            f"{recording.path}: the stretch reaches {high:.4g} {at}; it is length over length at "
            f"rest, so 150 % is 1.5: is it in per cent?"
        )
    if low < 0.1:
        raise InputError(
            f"{recording.path}: the stretch is {low:.4g} "
            f"at {_place(recording, int(np.argmin(stretch)))}; it is length over length at rest, "
            f"1 at the start: is it a strain?"
        )
    # compared with the stiffest and softest films, and a factor of safety
    pull = np.abs(stretch - stretch**-2.0)
    wide = pull > 0.5 * float(pull.max())
    if not (wide.any() and float(pull.max()) > 0.02):
        return
    modulus = float(np.median(np.abs(recording.signal[wide]) / pull[wide]))
    peak = float(np.max(np.abs(recording.signal)))
    if modulus > 2e7 or 0.0 < modulus < 200.0:
        side = "kPa or MPa imported as Pa" if modulus < 200.0 else "Pa imported as kPa"
        raise InputError(
            f"{recording.path}: a nominal stress of {peak * 1e-3:.4g} kPa at stretch {high:.4g} is "
            f"that of a modulus of {modulus:.2g} Pa, and films have 1e4 to 1e7 Pa; is it {side}, "
            f"or the area wrong?"
        )


def _gaps(recording: Recording, moved: np.ndarray) -> Iterator[str]:
    """Yield a sentence for each harmless jump of time; refuse one where the film may have moved."""
    steps = np.diff(recording.time)
    typical = float(np.median(steps))
    span = float(np.ptp(moved)) or 1.0
    for i in map(int, np.flatnonzero(steps > 5.0 * typical)):
        before, after = steps[max(i - 10, 0) : i], steps[i + 1 : i + 11]
        # a logger that changes its rate has short steps on one side only
        around = [float(np.median(s)) for s in (before, after) if s.size]
        if len(around) < 2 or steps[i] < 5.0 * max(around):
            continue
        jump = f"time jumps by {steps[i]:.4g} s after {_place(recording, i)}"
        around_it = moved[max(i - 3, 0) : i + 5]
        if float(np.ptp(around_it)) > 0.02 * span:
            raise InputError(
                f"{recording.path}: {jump}, and what drove the film meanwhile is not known; cut "
                f"the recording in two there, at rest"
            )
        yield f"{jump}; the drive is assumed constant meanwhile"


# ---------------------------------------------------------------- masked


def _runs(values: np.ndarray, shortest: int) -> list[tuple[int, int]]:
    """Return ``(start, end)`` of runs of at least ``shortest`` equal samples."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    starts = np.concatenate(([0], edges))
    ends = np.concatenate((edges, [values.size]))
    keep = ends - starts >= shortest
    return [(int(a), int(b)) for a, b in zip(starts[keep], ends[keep], strict=True)]


def _clipped(signal: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Return runs at the largest or smallest value that are longer than noise or a peak explains.

    The top of a peak in coarse steps is flat too, but hides no more than one step.
    """
    steps = np.abs(np.diff(signal))
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    noisy = float(np.median(np.abs(np.diff(signal, 2)))) > 0.25 * step
    found: list[tuple[int, int]] = []
    for extreme in (float(signal.max()), float(signal.min())):
        runs = []
        for a, b in _runs(signal, 8):
            if signal[a] != extreme:
                continue
            moving = int(np.count_nonzero(np.diff(moved[a:b])))
            reach = max(10, moving // 4)
            left, right = min(reach, a), min(reach, signal.size - b)
            slopes = [0.0]
            if left > 1:
                slopes.append(abs(signal[a] - signal[a - left]) / left)
            if right > 1:
                slopes.append(abs(signal[b - 1] - signal[b - 1 + right]) / right)
            hidden = 0.25 * max(slopes) * moving
            if (noisy and b - a >= 25) or hidden > 4.0 * step:
                runs.append((a, b))
        if sum(b - a for a, b in runs) >= 20:
            found += runs
    return sorted(found)


def _stuck(time: np.ndarray, signal: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Return runs of one value for at least 0.1 s and 15 samples while the drive changes."""
    span = float(np.ptp(moved)) or 1.0
    return [
        (a, b)
        for a, b in _runs(signal, 15)
        if time[b - 1] - time[a] >= 0.1 and float(np.ptp(moved[a:b])) > 0.1 * span
    ]


def _outliers(signal: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Return runs of up to 5 outliers between neighbours that agree, while the drive is steady.

    Where most of the steps before or after are as large, the film rings.
    """
    steps = np.diff(signal)
    noise = 1.4826 * float(np.median(np.abs(np.diff(signal, 2)))) / 6.0**0.5
    span = float(np.subtract(*np.percentile(signal, (99.0, 1.0))))
    far = max(15.0 * noise, 0.05 * span)
    drive_span = float(np.ptp(moved)) or 1.0
    found = []
    last = 0
    for i in np.flatnonzero(np.abs(steps) > far):
        a = int(i) + 1
        if a < last or a < 2:
            continue
        for b in range(a + 1, min(a + 6, signal.size - 1)):
            back = signal[b] - signal[b - 1]
            if abs(back) > far and back * steps[i] < 0.0:
                calm = max(
                    abs(signal[b] - signal[a - 1]),
                    abs(steps[i - 1]),
                    abs(steps[b]),
                    float(np.median(np.abs(steps[max(i - RINGING, 0) : i]))),
                    float(np.median(np.abs(steps[b : b + RINGING]))),
                )
                still = float(np.ptp(moved[a - 1 : b + 1])) < 0.05 * drive_span
                if calm < 0.3 * min(abs(steps[i]), abs(back)) and still:
                    found.append((a, b))
                    last = b + 1
                break
    return found


def _where(recording: Recording, what: str, runs: Sequence[tuple[int, int]]) -> str:
    samples = sum(b - a for a, b in runs)
    value = recording.signal[runs[0][0]]
    scale, unit = (1e3, "mm") if recording.kind == "actuator" else (1e-3, "kPa")
    places = "" if len(runs) == 1 else f", in {len(runs)} places"
    return (
        f"{what} at {value * scale:.4g} {unit} from {_place(recording, runs[0][0])} on"
        f"{places}; {samples} sample{'s' if samples > 1 else ''} taken out"
    )


def _place(recording: Recording, sample: int) -> str:
    return f"sample {sample} ({recording.time[sample]:.4g} s)"
