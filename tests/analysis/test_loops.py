"""Areas of loops and spectra, against shapes and noise that are known exactly."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dearig.analysis.loops import cycles, loop_area, loops, loops_of
from dearig.analysis.spectrum import amplitude_density
from dearig.errors import InputError
from tests.tools.recordings import run_counts, write_run

PHASE = np.linspace(0.0, 2.0 * np.pi, 4001)


@pytest.mark.parametrize(("way", "sign"), [(1.0, 1.0), (-1.0, -1.0)])
def test_area_of_an_ellipse(way: float, sign: float) -> None:
    x, y = 3.0 + 2.0 * np.cos(way * PHASE), -1e6 + 5.0 * np.sin(way * PHASE)
    assert loop_area(x, y) == pytest.approx(sign * math.pi * 10.0, rel=1e-5)


def lagging(lag: float, lobes: int, rest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Raised cosines of 6 kV with displacements of 2 mm that lag by ``lag`` rad, 1 s each."""
    phase = np.linspace(0.0, 2.0 * np.pi, 1001)[:-1]
    still = np.zeros(rest)
    volts = np.concatenate((still, np.tile(3e3 * (1.0 - np.cos(phase)), lobes), still))
    start = 1e-3 * (1.0 - math.cos(lag))
    moved = np.concatenate((
        still + start, np.tile(1e-3 * (1.0 - np.cos(phase - lag)), lobes), still + start,
    ))  # fmt: skip
    return np.arange(volts.size) / 1000.0, volts, moved


@pytest.mark.parametrize("rest", [0, 1, 700])
@pytest.mark.parametrize("lag", [0.3, -0.3])
def test_each_cycle_has_the_area_of_its_ellipse(lag: float, rest: int) -> None:
    found = loops_of(*lagging(lag, 4, rest))
    assert len(found.cycles) == 4
    expected = math.pi * 3e3 * 1e-3 * math.sin(lag)  # V m; positive where displacement lags
    for cycle in found.cycles:
        assert cycle.area == pytest.approx(expected, rel=1e-3)
        assert cycle.peak == pytest.approx(6e3)
        assert math.copysign(1.0, cycle.area_squared) == math.copysign(1.0, lag)
    assert found.mean_area() == pytest.approx(expected, rel=1e-3)


def test_area_against_the_square_is_that_of_the_curve_that_is_drawn() -> None:
    time, volts, moved = lagging(0.3, 1, 0)
    found = loops_of(time, volts, moved)
    assert found.mean_area(squared=True) == pytest.approx(loop_area(volts**2, moved), rel=1e-6)


@pytest.mark.parametrize(
    ("drive", "count"),
    [
        (np.zeros(100), 0),
        (np.array([]), 0),
        (3.0 + np.cos(np.linspace(0.0, 20.0 * np.pi, 5000)), 9),  # never at rest, ends at a peak
        (np.linspace(0.0, 1.0, 50), 0),  # a ramp does not come back
        (np.r_[np.zeros(30), np.hanning(50), np.zeros(30)], 1),
    ],
)
def test_cycles_go_from_valley_to_valley(drive: np.ndarray, count: int) -> None:
    assert len(cycles(drive)) == count


def test_noise_of_a_voltage_makes_no_cycles() -> None:
    time, volts, moved = lagging(0.3, 3, 500)
    noisy = volts + np.random.default_rng(1).normal(0.0, 30.0, volts.size)
    assert len(loops_of(time, noisy, moved).cycles) == 3


def test_loops_of_a_recording(tmp_path: Path) -> None:
    write_run(tmp_path / "lobes.h5", run_counts(6000))  # the displacement follows without a lag
    found = loops(tmp_path / "lobes.h5")
    assert found.name == "lobes"
    assert len(found.cycles) == 4  # the fifth lobe is cut off
    peak = max(cycle.peak for cycle in found.cycles)
    box = peak * float(np.ptp(found.displacement))
    assert all(abs(cycle.area) < 0.02 * box for cycle in found.cycles)
    assert found.voltage.shape == found.displacement.shape


def test_recording_without_a_voltage_has_no_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    film = SimpleNamespace(name="strip", voltage_command=None, displacement=None)
    monkeypatch.setattr("dearig.analysis.loops.open_recording", lambda _: film)
    with pytest.raises(InputError, match="strip has no voltage and displacement"):
        loops(Path("strip.h5"))


# spectra


@pytest.mark.parametrize("size", [64, 1000, 60_000])
def test_density_of_white_noise_is_known(size: int) -> None:
    rate, sigma = 500.0, 2e-6
    values = np.random.default_rng(size).normal(5.0, sigma, size)
    frequency, density = amplitude_density(values, rate)
    expected = sigma / math.sqrt(rate / 2.0)
    inner = density[1:-1]
    assert np.sqrt(np.mean(inner**2)) == pytest.approx(expected, rel=0.3 if size == 64 else 0.1)
    assert frequency[0] > 0.0  # no mean
    assert frequency[-1] == rate / 2.0


def test_squared_density_adds_up_to_the_variance() -> None:
    rng = np.random.default_rng(3)
    values = np.convolve(rng.normal(size=50_000), np.ones(7) / 7.0, "same")
    frequency, density = amplitude_density(values, 1000.0)
    power = float(np.sum(density**2) * (frequency[1] - frequency[0]))
    assert power == pytest.approx(values.var(), rel=0.05)


@pytest.mark.parametrize("values", [np.zeros(10), np.r_[np.zeros(500), np.nan]])
def test_too_few_samples_and_gaps_have_no_spectrum(values: np.ndarray) -> None:
    frequency, density = amplitude_density(values, 100.0)
    assert frequency.size == density.size == 0
