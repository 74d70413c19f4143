"""Recordings of means, as fits take them: nothing is shifted in time, and the noise is reached."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.run import record
from dearig.analysis.readings.record import Readings
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.settings import CardSettings
from dearig.model.film.material import TABLE_3, Branch, Network
from dearig.model.simulation.actuator import Actuator
from dearig.recording import export_recording, import_file, open_recording

LOBES = """\
name = "lobes"
lead_in_s = 1.0
tail_s = 0.2
[[segment]]
kind = "half_sine"
amplitude_kV = 7.0
frequency_Hz = 2.0
repeats = 4
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 0.5
"""
ROW_RATE = 200.0
#: The amplifier has followed when the monitor is converted, and the scan fits in 50 us.
QUICK = {"first_convert_us": 30.0, "convert_interval_us": 4.0}


def rig_file(average: int) -> RigFile:
    return RigFile(card=CardSettings(sample_rate_Hz=ROW_RATE, average=average, **QUICK))


TRUTH = Actuator(RigFile().as_film(), RigFile().as_load(), TABLE_3)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("runs")
    paths = {}
    for average in (1, 10, 100):
        paths[average] = folder / f"of{average}.h5"
        record(parse_sequence(LOBES, "lobes", Path()), "sim", rig_file(average), paths[average])
    return paths


def late_by(path: Path, drive: str = "command") -> tuple[float, float]:
    """Return by how many s the readings are later than the record says, and the noise of that."""
    record_ = Readings(open_recording(path), drive).record
    moved = record_.seen(TRUTH.simulate(record_.drive, record_.lag).displacement)
    speed = np.gradient(moved, record_.time)
    left = record_.displacement - moved
    weight = float(np.sum(speed**2))
    return -float(np.sum(speed * left)) / weight, record_.noise / weight**0.5


@pytest.mark.parametrize("average", [1, 10, 100])
@pytest.mark.parametrize("drive", ["command", "monitor"])
def test_means_are_about_their_middle(runs: dict[int, Path], average: int, drive: str) -> None:
    if average == 1 and drive == "monitor":
        pytest.skip("a monitor's single readings are taken as held")
    late, error = late_by(runs[average], drive)
    # the laser's clock (10 us), the amplifier's lag (6 us); half a conversion is 250 and 25 us
    assert abs(late) < 17e-6 + 3.0 * error


@pytest.mark.parametrize("to", ["csv", "mat"])
def test_an_exported_table_comes_back_as_means(
    runs: dict[int, Path], tmp_path: Path, to: str
) -> None:
    again = tmp_path / "again.h5"
    import_file(export_recording(runs[10], to, tmp_path / f"x.{to}"), again)
    record_ = Readings(open_recording(again)).record
    assert (record_.means_of, record_.average, record_.drive.hold) == (10, 10, False)
    assert record_.lag == pytest.approx(Readings(open_recording(runs[10])).record.lag)


def test_a_record_of_means_says_so(runs: dict[int, Path]) -> None:
    single, averaged = (Readings(open_recording(runs[n])) for n in (1, 100))
    assert (single.record.means_of, single.record.drive.hold) == (1, True)
    assert (averaged.record.means_of, averaged.record.drive.hold) == (100, False)
    assert not averaged.held().record.drive.hold
    recording = averaged.recording
    expected = recording.displacement_delay - recording.displacement_skew
    assert averaged.record.lag == pytest.approx(expected + 0.5 / (100 * ROW_RATE))
    assert single.record.lag == (
        single.recording.displacement_delay - single.recording.displacement_skew
    )


def scaled(place: int, factor: float) -> Actuator:
    """Return the true film with one of its moduli or relaxation times changed."""
    springs, times = list(TABLE_3.springs), list(TABLE_3.times)
    if place < len(springs):
        springs[place] = replace(springs[place], modulus=factor * springs[place].modulus)
    else:
        times[place - len(springs)] *= factor
    branches = tuple(Branch(*each) for each in zip(springs[1:], times, strict=True))
    return replace(TRUTH, network=Network(springs[0], branches))


@pytest.mark.parametrize("average", [10, 100])
def test_moduli_and_relaxation_times_have_no_bias(runs: dict[int, Path], average: int) -> None:
    # rows of 5 ms, within which the voltage of the fast lobes bends
    record_ = Readings(open_recording(runs[average])).record

    def seen(model: Actuator) -> np.ndarray:
        return record_.seen(model.simulate(record_.drive, record_.lag).displacement)

    true = seen(TRUTH)
    left = (record_.displacement - true) / record_.noise
    assert np.mean(left**2) == pytest.approx(1.0, abs=0.15)
    step = 1e-3
    slopes = [(seen(scaled(i, 1.0 + step)) - true) / (step * record_.noise) for i in range(7)]
    basis = np.linalg.qr(np.stack(slopes, axis=1))[0]
    # what a fit gains by leaving the truth: chi-square of 7 degrees of freedom, 99.9 %
    assert float(np.sum((basis.T @ left) ** 2)) < 24.3
