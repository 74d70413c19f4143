"""Excitation within the limits of a rig: what separates rivals, and what training lacks."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic import ValidationError

from dearig.acquisition.plan import Plan, plan
from dearig.acquisition.prediction import peaks_of
from dearig.analysis.outcomes import (
    DeterminingRecord,
    DiagnoseOutcome,
    SeparatingExperiment,
)
from dearig.analysis.readings.band import motion_of
from dearig.analysis.readings.compatibility import of_rig
from dearig.analysis.readings.record import Readings
from dearig.analysis.readings.rig_channels import AVERAGED, RigChannels, channels_of
from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.drivers.gate import GatedWaveform
from dearig.drivers.interlocks import would_trip
from dearig.drivers.samples import Repeated
from dearig.drivers.settings import CardSettings
from dearig.errors import InputError
from dearig.model.diagnosis.excitation import Excitation, PredictedRun, excitation, range_of
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.kernel import OK
from dearig.model.readings.measures import root_mean_square
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import THESIS_AMPLITUDES

__all__ = [
    "SEPARATES",
    "SHARED",
    "averaging",
    "candidates",
    "determining_record",
    "experiment_of",
    "separating_experiment",
    "with_excitation",
]

#: RMS difference of two predictions, in noise floors, from which an experiment separates them.
SEPARATES = 0.5

#: Probability from which a family that is not named shares it: one in twenty.
SHARED = 0.05

# factors of the amplitudes, tried in turn until a sequence can be played and measured
_SCALES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2)
_INTERLOCK_MARGIN = 0.7  # part of an interlock's threshold: no rival predicts the film exactly
_DELAY_BLUR = 1.0  # noise floors; largest displacement within the uncertainty of the laser's delay
_NO_CHANNELS = RigChannels()
_NEAR_BEST = 0.9  # part of the best separation; above it the highest separation per second wins


def candidates(top_kV: float) -> Mapping[str, str]:
    """Return sequences of different kinds up to ``top_kV``, as TOML by name."""
    half = round(0.45 * top_kV, 3)
    low, middle = round(0.4 * top_kV, 3), round(0.7 * top_kV, 3)
    found: dict[str, list[dict[str, Any]]] = {
        "slow lobes of four heights": [
            {"kind": "half_sine", "amplitude_kV": round(a * top_kV, 3), "frequency_Hz": 0.2}
            for a in (0.4, 0.6, 0.8, 1.0)
        ],
        "fast lobes": [
            {
                "kind": "half_sine",
                "amplitude_kV": round(a * top_kV, 3),
                "frequency_Hz": f,
                "repeats": 6,
            }
            for a, f in ((0.6, 2.0), (1.0, 2.0), (0.6, 5.0), (1.0, 5.0))
        ],
        "triangles within triangles": [
            {"kind": "triangle", "amplitude_kV": a, "frequency_Hz": 0.25, "repeats": 2}
            for a in (top_kV, low, middle, top_kV)
        ],
        "quick steps": [_steps(top_kV, 0.5, 2)],
        "steps": [_steps(top_kV, 2.0, 1)],
        "slow steps": [_steps(top_kV, 6.0, 1)],
        "a long hold": [
            {"kind": "ramp", "to_kV": round(0.9 * top_kV, 3), "duration_s": 0.2},
            {"kind": "hold", "duration_s": 25.0},
            {"kind": "ramp", "to_kV": 0.0, "duration_s": 0.2},
            {"kind": "hold", "duration_s": 12.0},
        ],
    }
    for name, (first, last) in {
        "a slow chirp": (0.05, 1.0), "a chirp": (0.5, 15.0), "a fast chirp": (5.0, 60.0),
    }.items():  # fmt: skip
        found[name] = [
            {"kind": "ramp", "to_kV": round(0.5 * top_kV, 3), "duration_s": 1.0},
            {
                "kind": "chirp", "amplitude_kV": half, "from_Hz": first, "to_Hz": last,
                "duration_s": 20.0,
            },
            {"kind": "ramp", "to_kV": 0.0, "duration_s": 1.0},
            {"kind": "hold", "duration_s": 1.0},
        ]  # fmt: skip
    made = {name: tomli_w.dumps({"name": name, "segment": found[name]}) for name in found}
    named = ("rich", "validation-a-0.2", "validation-a-1.0", "validation-b-8.0")
    return made | {name: PRESETS[name] for name in named}


def _steps(top_kV: float, dwell_s: float, repeats: int) -> dict[str, Any]:
    levels = [round(a * top_kV, 3) for a in (0.5, 1.0, 0.7, 0.9, 0.3, 0.8)]
    return {
        "kind": "steps", "levels_kV": [*levels, 0.0], "dwell_s": dwell_s, "rise_s": 0.02,
        "repeats": repeats,
    }  # fmt: skip


def separating_experiment(
    rivals: Sequence[tuple[str, str, Actuator]],
    rig_file: RigFile,
    noise: float,
    electric: RigChannels = _NO_CHANNELS,
) -> tuple[SeparatingExperiment | None, str]:
    """Return the sequence that separates the two closest of ``rivals`` best, and a sentence on it.

    Pairs of rivals that no sequence separates are left out: both may differ from a third rival.

    ``rivals`` are (label, family, fitted model), the final model among them; ``noise`` is the floor
    of one reading in m. Every sequence passes the gate of ``rig_file`` and trips no interlock if
    the film does what any rival predicts. Where there is no such sequence, the sentence says why.
    With the ``electric`` channels of the rig, what they would tell counts as well, as so much more
    displacement; a recording with more conversions in a row is proposed where that tells more.
    """
    labels = tuple(label for label, _, _ in rivals)
    families = tuple(dict.fromkeys(family for _, family, _ in rivals))
    made: list[_Tried] = []
    averages: tuple[int, ...] = ()
    for name, text in candidates(_top_kV(rig_file)).items():
        playable = _playable(text, name, rivals, rig_file, noise)
        if playable is None:
            continue
        loaded, waveform, predictions = playable
        averages = averages or _averages(electric, loaded, rig_file)
        for average in averages:
            apart = {
                (labels[i], labels[j]): _separation(
                    (rivals[i][2], rivals[j][2]), (predictions[i], predictions[j]),
                    waveform, noise, electric, average, rig_file.card,
                )
                for i, j in combinations(range(len(rivals)), 2)
            }  # fmt: skip
            made.append(_Tried(name, apart, waveform.duration, loaded.toml, average))
    if not made:
        return None, (
            "None of the candidate excitations can be played: each would break a limit or trip an "
            "interlock of the rig file"
        )
    pairs = list(made[0].apart)
    separable = [p for p in pairs if max(t.apart[p].whole for t in made) >= SEPARATES]

    def closest(tried: _Tried) -> tuple[str, str]:
        return min(separable or pairs, key=lambda pair: tried.apart[pair].whole)

    def separation(tried: _Tried) -> float:
        return tried.apart[closest(tried)].whole

    made.sort(key=separation, reverse=True)
    best = separation(made[0])
    if best < SEPARATES:
        return None, (
            f"None of {len({t.name for t in made})} excitations within the rig's limits separates "
            f"{_and(labels)}: at best their predictions differ by {best:.2g} times the noise"
        )
    good = [t for t in made if separation(t) >= _NEAR_BEST * best]
    # what the rig does already, where that tells as much
    average = min(t.average for t in good)
    chosen = max((t for t in good if t.average == average), key=lambda t: separation(t) / t.seconds)
    found = SeparatingExperiment(
        name=chosen.name,
        sequence=chosen.toml,
        rivals=labels,
        separates=families,
        separation=separation(chosen),
        closest=closest(chosen),
        seconds=chosen.seconds,
        tried=tuple(
            (t.name, separation(t), t.seconds) for t in made if t.average == chosen.average
        ),
        average=chosen.average,
        by_channel=chosen.apart[closest(chosen)].by_channel,
    )
    alike = [_and(p) for p in pairs if p not in separable]
    but = f". No excitation separates {'; '.join(alike)}" if alike else ""
    two = "any two that can be separated" if alike else "any two"
    return found, (
        f"{chosen.name!r} ({chosen.seconds:.0f} s) separates {_and(labels)} best among "
        f"{len(found.tried)} excitations within the rig's limits: the predictions of {two} "
        f"differ by at least {found.separation:.2g} times the noise"
        f"{_by_channels(found, rig_file.card.average)}{but}"
    )


@dataclass(frozen=True)
class _Apart:
    """How far two predictions are apart, in noises of the displacement.

    ``by_channel`` are RMS differences, each in noises of its own channel.
    """

    whole: float
    by_channel: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class _Tried:
    name: str
    apart: Mapping[tuple[str, str], _Apart]
    seconds: float
    toml: str
    average: int


def _averages(electric: RigChannels, loaded: LoadedSequence, rig_file: RigFile) -> tuple[int, ...]:
    """Return the numbers of conversions in a row to be tried: what the rig does, and more.

    More is the largest of a few numbers for which the card has time, and with which the rig can
    play ``loaded``. None is tried where no channel gains by it.
    """
    usual = rig_file.card.average
    for part in (1, 2, 4, 10) if electric.channels else ():
        more = AVERAGED // part
        if usual >= more:
            break
        try:
            plan(loaded, averaging(rig_file, more)).admitted()
        except InputError:
            continue
        return usual, more
    return (usual,)


def averaging(rig_file: RigFile, average: int) -> RigFile:
    """Return ``rig_file`` with ``average`` conversions in a row.

    Raises ``InputError`` where the card cannot do that.
    """
    tables = rig_file.model_dump()
    tables["card"]["average"] = average
    try:
        return RigFile.model_validate(tables)
    except ValidationError as error:
        said = error.errors(include_url=False)[0]["msg"].removeprefix("Value error, ")
        raise InputError(f"rows of {average} conversions: {said}") from error


def _separation(
    models: tuple[Actuator, Actuator],
    predictions: tuple[np.ndarray, np.ndarray],
    waveform: GatedWaveform,
    noise: float,
    electric: RigChannels,
    average: int,
    card: CardSettings,
) -> _Apart:
    """Return how far two models are apart; of two films that could be, the one that shows less."""
    moved = root_mean_square(predictions[0] - predictions[1]) / noise
    if not electric.channels:
        return _Apart(moved, (("displacement", moved),))
    stride = round(waveform.samples / predictions[0].size)
    conversions = stride * average / card.average
    drive = _drive(waveform, stride)
    both = [
        electric.apart(
            models[i], models[1 - i], drive, predictions[i], conversions, means=average > 1
        )
        for i in (0, 1)
    ]
    less = min(both, key=lambda seen: sum(chi2 for chi2, _ in seen.values()))
    chi2 = sum(value for value, _ in less.values())
    return _Apart(
        math.sqrt(moved**2 + chi2 * card.average / waveform.samples),
        (("displacement", moved), *((name, rms) for name, (_, rms) in less.items())),
    )


def _by_channels(found: SeparatingExperiment, usual: int) -> str:
    """Return what the best electrical channel would show, and how to record it; "" without one."""
    electric = [pair for pair in found.by_channel if pair[0] != "displacement"]
    if not electric:
        return ""
    name, apart = max(electric, key=lambda pair: pair[1])
    if found.average == usual and round(apart, 2) == 0.0:
        return ""  # it shows nothing
    channel = name.replace("_", " ")
    said = f". Means of the {channel} at 200 Hz differ by {apart:.2g} times their noise"
    if found.average != usual:
        said += f", if every row is the mean of {found.average} conversions"
    return said


def determining_record(
    model: Actuator, asked: Sequence[Excitation], rig_file: RigFile, noise: float
) -> DeterminingRecord | None:
    """Return the shortest sequence that shows what is ``asked``, None where none does.

    With its recording, every band of ``asked`` would be determined, if the film does what ``model``
    predicts. ``noise`` is the floor of one reading in m. The sequence passes the gate of
    ``rig_file`` and trips no interlock.
    """
    rig_file = of_rig(rig_file, model.film, model.load)
    found: list[DeterminingRecord] = []
    for name, text in candidates(_top_kV(rig_file)).items():
        playable = _playable(text, name, [("", "", model)], rig_file, noise)
        if playable is None:
            continue
        loaded, waveform, (moved,) = playable
        motion = PredictedRun(name, waveform.duration / moved.size, np.zeros(1), moved, noise)
        left = [each.after(motion) for each in asked]
        if not any(each.undetermined for each in left):
            worst = max(each.open_rms for each in left)
            found.append(DeterminingRecord(name, loaded.toml, waveform.duration, worst))
    return min(found, key=lambda record: record.seconds, default=None)


def _top_kV(rig_file: RigFile) -> float:  # noqa: N802
    """Return the rig's limit, and at most the voltage of the thesis's experiments."""
    return math.floor(min(rig_file.gate_limits().voltage_max / 1e3, 8.0) * 1e3) / 1e3


def _playable(
    text: str,
    name: str,
    rivals: Sequence[tuple[str, str, Actuator]],
    rig_file: RigFile,
    noise: float,
) -> tuple[LoadedSequence, GatedWaveform, list[np.ndarray]] | None:
    """Return the sequence at the largest playable amplitude, and the predictions (m) of ``rivals``.

    None where it can be played at no amplitude.
    """
    for scale in _SCALES:
        try:
            loaded = parse_sequence(_scaled(text, scale), name, Path())
            planned = plan(loaded, rig_file)
            waveform = planned.admitted()
        except InputError:
            continue
        predictions = _predictions(rivals, waveform, planned.stride)
        if predictions is None:
            continue
        if not any(_would_end(planned, waveform, p, rig_file, noise) for p in predictions):
            return loaded, waveform, predictions
    return None


def _would_end(
    planned: Plan, waveform: GatedWaveform, moved: np.ndarray, rig_file: RigFile, noise: float
) -> bool:
    """Return whether a film at ``moved`` (M,) m would trip an interlock or be too fast to measure.

    There is one position for each stride of the plan. The laser has its own clock, so the age of a
    reading is uncertain by its period.
    """
    speed = float(np.max(np.abs(np.diff(moved)))) * waveform.rate / planned.stride
    if speed * rig_file.laser.delay_error > _DELAY_BLUR * noise:
        return True
    predicted = planned.displacement_of_samples
    # a film that moves more than predicted, and one that moves less
    return any(
        would_trip(
            rig_file,
            waveform.rate,
            waveform,
            Repeated(part * moved, planned.stride, waveform.samples),
            predicted,
        )
        for part in (1.0 / _INTERLOCK_MARGIN, _INTERLOCK_MARGIN)
    )


def _scaled(text: str, scale: float) -> str:
    """Return the sequence with all its voltages times ``scale``."""
    if scale == 1.0:
        return text

    def lower(value: Any, key: str = "") -> Any:
        if isinstance(value, dict):
            return {k: lower(v, k) for k, v in value.items()}
        if isinstance(value, list):
            return [lower(v, key) for v in value]
        return round(value * scale, 3) if key.endswith("_kV") else value

    data = tomllib.loads(text)
    for segment in data["segment"]:
        if segment["kind"] == "thesis":
            segment.setdefault("amplitudes_kV", [a / 1e3 for a in THESIS_AMPLITUDES])
    return tomli_w.dumps(lower(data))


def _predictions(
    rivals: Sequence[tuple[str, str, Actuator]], waveform: GatedWaveform, stride: int
) -> list[np.ndarray] | None:
    """Return displacements (M,) of all rivals in m, one for each ``stride`` of the samples.

    None where one fails or exceeds the field limit.
    """
    drive = _drive(waveform, stride)
    found = []
    for _, _, model in rivals:
        response = model.simulate(drive)
        if response.status != OK:
            return None
        if float(np.max(np.abs(response.field))) > waveform.limits.field:
            return None
        found.append(response.displacement)
    return found


def _drive(waveform: GatedWaveform, stride: int) -> Drive:
    peaks = peaks_of(waveform, stride)
    return Drive(np.arange(peaks.size) * (stride / waveform.rate), peaks, hold=True)


def _and(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)


def experiment_of(
    finding: Diagnosis,
    noise: float,
    rig_file: RigFile,
    rejected: bool = False,
    readings: Sequence[Readings] = (),
) -> tuple[SeparatingExperiment | None, str]:
    """Return the experiment that separates the final model from its rivals, and a sentence.

    Rivals are the families that explain the data as well, and those that share the probability.
    Where the final model is ``rejected``, they are the most probable of all others. The electrical
    channels of the ``readings`` that were fitted count as well, where they were of use.
    """
    final = finding.final.model
    if not isinstance(final, Actuator):
        return None, "No experiment is proposed: films are driven by no voltage sequence"
    shared = {family for family, p in finding.marginals if p >= SHARED}
    known = {family for family, _ in finding.rivals}
    others = [
        (family, model)
        for family, model in finding.runners_up
        if family not in known and (rejected or family in shared)
    ]
    rivals = [(_model_label(final), _contested(finding), final)]
    for family, model in (*finding.rivals, *others):
        if isinstance(model, Actuator):
            rivals.append((_model_label(model), family, model))
    if len(rivals) > 1:
        return separating_experiment(
            rivals,
            of_rig(rig_file, final.film, final.load),
            noise,
            channels_of(readings, finding),
        )
    if rejected:
        return None, (
            "The model leaves more than noise, and no other was fitted that an experiment could "
            "separate from it: record other amplitudes and frequencies, and diagnose them together"
        )
    return None, "No other family explains these data as well: there is nothing to separate"


def _contested(finding: Diagnosis) -> str:
    """Return the family of the effect that rivals contest."""
    contested = [s for s in finding.steps if s.indistinguishable_from] or list(finding.steps)
    return contested[0].family if contested else "none"


def _model_label(model: Actuator) -> str:
    return " with ".join(name for name, _ in model.effects) or "the baseline"


def with_excitation(outcome: DiagnoseOutcome, rig_file: RigFile) -> DiagnoseOutcome:
    """Return ``outcome`` with what its validation recordings ask of the model that is judged.

    Where the training recordings do not determine that, it has the shortest sequence within the
    limits of ``rig_file`` that would. Films are driven by no sequence, and stay as they are.
    """
    after, model = outcome.after, outcome.finding.final.predicting
    if outcome.kind == "film" or not after.validation or not isinstance(model, Actuator):
        return outcome
    fitted = [motion_of(c, outcome.noise) for c in after.train]
    asked = [motion_of(c, outcome.noise) for c in after.validation]
    found = replace(
        outcome,
        excitation=tuple(
            excitation(fitted, motion, c.measured - c.model)
            for motion, c in zip(asked, after.validation, strict=True)
        ),
        tested=range_of(asked),
    )
    if not found.undetermined:
        return found
    record = determining_record(model, found.undetermined, rig_file, outcome.noise)
    return replace(found, determining=record)
