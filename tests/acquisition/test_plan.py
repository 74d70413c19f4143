"""A plan is computed piece by piece: as a whole one would be, in little memory, and on demand."""

from __future__ import annotations

import itertools
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.plan import plan
from dearig.acquisition.prediction import PredictedFilm, peaks_of
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.drivers import gate
from dearig.errors import InputError, Interrupted
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.kinematics import thinning
from dearig.model.simulation.actuator import Actuator, Drive

LOBES = 'kind = "thesis"\namplitudes_kV = [5.0, 7.5]\nfrequencies_Hz = [1.0, 2.0]\n'
STEPS = 'kind = "steps"\nlevels_kV = [5.0, 7.0, 2.0, 0.0]\ndwell_s = 0.4\nrise_s = 0.02\n'
CHIRP = (
    'kind = "chirp"\namplitude_kV = 0.9\nfrom_Hz = 5.0\nto_Hz = 80.0\nduration_s = 2.0\n'
    "offset_kV = 0.0\n"
)


def sequence(*segments: str) -> LoadedSequence:
    tables = "\n".join(f"[[segment]]\n{segment}" for segment in segments)
    return parse_sequence(f'name = "x"\nlead_in_s = 0.1\ntail_s = 0.1\n{tables}', "x", Path())


def rig(rate: float, **limits: float) -> RigFile:
    interval = min(10.0, 0.2e6 / rate)
    return RigFile.model_validate(
        {
            "card": {
                "sample_rate_Hz": rate,
                "first_convert_us": interval,
                "convert_interval_us": interval,
                "ai_rate_max_kHz": 4000.0,
            },
            "limits": {"voltage_min_kV": -2.0, **limits},
        }
    )


def simulated(loaded: LoadedSequence, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement (N,) m and true field (N,) V/m of a simulation that holds every sample."""
    time, voltage = loaded.sample(rate)
    response = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3).simulate(Drive(time, voltage, hold=True))
    assert response.ok
    thin = thinning(THESIS_FILM.held, response.stretch) / THESIS_FILM.thickness
    return response.displacement, np.abs(voltage) * thin


@pytest.mark.parametrize("segment", [LOBES, STEPS, CHIRP])
@pytest.mark.parametrize("rate", [997.0, 44000.0])
def test_windows_of_a_sequence_are_cut_from_the_whole(segment: str, rate: float) -> None:
    loaded = sequence(segment, LOBES)
    whole, clocked = loaded.sample(rate)[1], loaded.on_clock(rate)
    assert clocked.samples == whole.size
    cuts = [0, 1, 100, 777, whole.size // 2, whole.size - 1, whole.size]
    parts = [clocked.window(a, b) for a, b in itertools.pairwise(cuts)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("segment", [LOBES, STEPS])
def test_the_prediction_is_that_of_a_whole_simulation(segment: str) -> None:
    loaded = sequence(segment)
    planned = plan(loaded, rig(1000.0))
    displacement, field = simulated(loaded, 1000.0)
    np.testing.assert_allclose(planned.displacement, displacement, atol=2e-7)
    assert planned.waveform is not None
    # the film at the end of each step is no thicker than at its beginning, where it is pulled
    assert (planned.field >= field * (1.0 - 1e-6)).all()
    np.testing.assert_allclose(planned.field, field, rtol=0.02, atol=1e3)


@pytest.mark.parametrize("segment", [LOBES, STEPS, CHIRP])
def test_merged_steps_never_predict_a_lower_field(segment: str) -> None:
    loaded, rate = sequence(segment), 64000.0
    planned = plan(loaded, rig(rate))
    displacement, field = simulated(loaded, rate)
    assert planned.stride == 8
    assert planned.waveform is not None
    predicted = np.repeat(planned.field, planned.stride)[: planned.samples]
    assert (predicted >= field * (1.0 - 1e-4)).all()
    assert planned.waveform.margins[3].reached >= field.max() * (1.0 - 1e-4) * 1e-6
    assert planned.waveform.margins[3].reached <= field.max() * 1.02 * 1e-6
    moved = planned.displacement_of_samples.window(0, planned.samples)
    # each value stands for its step; at 80 Hz the film moves by 5 % within one
    np.testing.assert_allclose(moved, displacement, atol=0.06 * np.abs(displacement).max())


def test_slow_voltage_takes_fewer_steps_than_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[int] = []
    advance = PredictedFilm._advance

    def counted(self: PredictedFilm, start: int, merged: int, peaks: np.ndarray) -> np.ndarray:
        taken.append(peaks.size)
        return advance(self, start, merged, peaks)

    monkeypatch.setattr(PredictedFilm, "_advance", counted)
    counts = []
    for segment in ('kind = "hold"\nduration_s = 2.0\n', CHIRP):
        taken.clear()
        planned = plan(sequence(segment), rig(64000.0))
        counts.append(sum(taken) / planned.displacement.size)
    assert counts[0] == pytest.approx(1.0 / 8.0, rel=0.01)
    assert counts[1] > 2.0 * counts[0]


def test_the_prediction_ends_where_the_voltage_leaves_its_limits() -> None:
    planned = plan(sequence(STEPS), rig(1000.0, voltage_max_kV=6.0))
    assert planned.reasons
    assert all("voltage reaches 7 kV" in reason for reason in planned.reasons[:1])
    beyond = int(np.argmax(planned.voltage.window(0, planned.samples) > 6e3))
    assert np.isfinite(planned.displacement[:beyond]).all()
    assert np.isnan(planned.displacement[beyond:]).all()
    with pytest.raises(InputError, match=r"is refused: voltage reaches 7 kV"):
        planned.admitted()


def test_a_plan_holds_no_waveform(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gate, "_KEPT", 4)
    hold = 'kind = "hold"\nduration_s = 60.0\n'
    settings = rig(100e3)
    plan(sequence(LOBES), settings)  # what is allocated once is not of the plan
    tracemalloc.start()
    try:
        planned = plan(sequence(LOBES, hold), settings)
        assert planned.waveform is not None
        assert planned.waveform.window(0, 100).size == 100
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert planned.samples > 6_000_000
    assert peak < 0.4 * 8 * planned.samples


def test_progress_is_told_and_ends_a_plan() -> None:
    told: list[tuple[str, float]] = []
    loaded, settings = sequence(LOBES), rig(200e3)
    plan(loaded, settings, progress=lambda stage, part: told.append((stage, part)))
    assert {stage for stage, _ in told} == {"planning"}
    assert [part for _, part in told] == sorted(part for _, part in told)
    assert told[-1][1] == 1.0
    assert len(told) > 3

    def enough(stage: str, part: float) -> None:
        raise Interrupted(f"{stage} at {part}")

    with pytest.raises(Interrupted, match="planning at 0"):
        plan(loaded, settings, progress=enough)


def test_who_observes_a_plan_sees_every_sample_once() -> None:
    loaded, seen = sequence(LOBES, STEPS), []

    def observe(start: int, volts: np.ndarray) -> None:
        assert start == sum(part.size for part in seen)
        seen.append(volts.copy())

    plan(loaded, rig(100e3), observe=observe)
    np.testing.assert_array_equal(np.concatenate(seen), loaded.sample(100e3)[1])


@pytest.mark.parametrize("stride", [1, 4, 32])
def test_peaks_are_the_samples_farthest_from_zero(stride: int) -> None:
    voltage = sequence(CHIRP, LOBES).on_clock(10e3)
    values = voltage.window(0, voltage.samples)
    groups = [values[i : i + stride] for i in range(0, values.size, stride)]
    expected = np.array([group[np.argmax(np.abs(group))] for group in groups])
    np.testing.assert_array_equal(np.abs(peaks_of(voltage, stride)), np.abs(expected))
