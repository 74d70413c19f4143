"""A look at recordings before they are used: what is masked, what is refused, in which words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.compatibility import check_apart
from dearig.analysis.readings.enough import check_enough, extrapolated, overlap
from dearig.analysis.readings.record import Readings
from dearig.errors import InputError
from dearig.model.film.material import (
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    Network,
    Spring,
)
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.recording import open_recording
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.reading.recording import Recording
from dearig.recording.writing.save import save_recording
from tests.tools.command import dearig, done
from tests.tools.recordings import write_run

RATE = 250.0
NOISE = 1e-6
Values = dict[str, np.ndarray]


def lobes(seed: int = 0, seconds: float = 10.0) -> Values:
    """A quiet second and lobes of 6 kV at 0.5 Hz, which move the film by 0.5 mm."""
    time = np.arange(round(seconds * RATE)) / RATE
    voltage = np.where(time < 1.0, 0.0, 6e3 * np.abs(np.sin(0.5 * np.pi * (time - 1.0))))
    noise = np.random.default_rng(seed).normal(0.0, NOISE, time.size)
    return {
        "time": time,
        "voltage_command": voltage,
        "displacement": 0.5e-3 * (voltage / 6e3) ** 2 + noise,
    }


def cycles(seed: int = 0) -> Values:
    """Two cycles of stretch to 2 of a film of 40 kPa."""
    time = np.arange(1000) / 25.0
    stretch = 1.5 - 0.5 * np.cos(0.1 * np.pi * time)
    noise = np.random.default_rng(seed).normal(0.0, 50.0, time.size)
    return {
        "time": time,
        "stretch": stretch,
        "nominal_stress": 40e3 * (stretch - stretch**-2.0) + noise,
    }


def saved(path: Path, values: Values) -> Recording:
    kind = "film" if "stretch" in values else "actuator"
    film, load = (None, None) if kind == "film" else (THESIS_FILM, THESIS_LOAD)
    kinematics = "uniaxial" if kind == "film" else None
    save_recording(
        path, kind, values, RunMetadata(title=path.stem, film=film, load=load),
        kinematics=kinematics, overwrite=True,
    )  # fmt: skip
    return open_recording(path)


@pytest.fixture
def keep(tmp_path: Path) -> Callable[[Values], Recording]:
    return lambda values: saved(tmp_path / "run.h5", values)


class TestGood:
    def test_nothing_is_said_of_sound_recordings(self, keep):
        for values in (lobes(), cycles()):
            look = Readings(keep(values)).quality
            assert look.valid is None
            assert look.findings == ()

    def test_nor_of_counts_that_repeat(self, tmp_path):
        write_run(tmp_path / "run.h5")
        look = Readings(open_recording(tmp_path / "run.h5")).quality
        assert (look.valid, look.findings) == (None, ())

    @pytest.mark.parametrize(("coarse", "converter"), [(20e-6, 20e-6), (6e-6, 1.22e-6)])
    def test_coarse_steps_are_neither_a_stuck_sensor_nor_a_clipped_one(
        self, keep, coarse, converter
    ):
        values = lobes()
        smooth = 0.5e-3 * (values["voltage_command"] / 6e3) ** 2
        values["displacement"] = 0.5 * (values["displacement"] + smooth)  # half of the noise
        for step in (coarse, converter):
            values["displacement"] = np.round(values["displacement"] / step) * step
        said = " ".join(Readings(keep(values)).quality.findings)
        assert "stuck" not in said
        assert "clipped" not in said

    def test_a_step_of_the_voltage_is_not_a_dropout(self, keep):
        values = lobes()
        on = (values["time"] > 2.0) & (values["time"] < 2.01)
        values["voltage_command"] = np.where(on, 6e3, 0.0)
        values["voltage_command"][1000:] = 3e3
        still = np.random.default_rng(3).normal(0.0, NOISE, on.size)
        values["displacement"] = 0.4e-3 * on + 0.1e-3 * (values["time"] >= 4.0) + still
        assert Readings(keep(values)).quality.valid is None


class TestSign:
    """As of a laser that is mounted the other way round, or of compression written as positive."""

    @pytest.mark.parametrize(
        ("values", "signal", "what"),
        [
            (lobes(), "displacement", "displacement falls where the voltage rises"),
            (cycles(), "nominal_stress", "stress falls where the stretch rises"),
        ],
    )
    def test_a_signal_with_the_other_sign_is_asked_about(self, keep, values, signal, what):
        values[signal] = -values[signal]
        look = Readings(keep(values)).quality
        assert look.valid is None
        assert [f"{what}: is its sign right?" in finding for finding in look.findings] == [True]

    def test_a_model_that_fails_under_the_drive_is_not_the_only_thing_reported(self, keep):
        values = lobes()
        values["displacement"] = -values["displacement"]
        soft = Actuator(THESIS_FILM, THESIS_LOAD, Network(Spring(50.0)))
        with pytest.raises(InputError, match=r"is its sign right\?.*cannot follow it: no rest"):
            compare(Readings(keep(values)), soft, "train")


class TestMasks:
    def test_a_clipped_sensor(self, keep):
        values = lobes()
        clipped = values["displacement"] > 0.4e-3
        values["displacement"] = np.minimum(values["displacement"], 0.4e-3)
        recording = keep(values)
        look = Readings(recording).quality
        assert not look.valid[clipped].any()
        # a small margin, and nothing else
        assert np.count_nonzero(~look.valid) <= np.count_nonzero(clipped) + 4 * 6
        (sentence,) = look.findings
        first = int(np.argmax(clipped))
        assert "the sensor is clipped at 0.4 mm" in sentence
        assert f"sample {first} ({recording.time[first]:.4g} s)" in sentence

    def test_a_stuck_sensor(self, keep):
        values = lobes()
        values["displacement"][600:700] = values["displacement"][600]
        look = Readings(keep(values)).quality
        assert not look.valid[600:700].any()
        assert look.valid[:597].all()
        assert look.valid[703:].all()
        assert "the sensor is stuck" in look.findings[0]
        assert "sample 600 (2.4 s)" in look.findings[0]
        assert "100 samples taken out" in look.findings[0]

    @pytest.mark.parametrize("reading", [0.0, 10e-3, -4e-3])
    @pytest.mark.parametrize("length", [1, 3])
    def test_dropouts(self, keep, reading, length):
        values = lobes()
        at = 1.0 + np.array([0.5, 2.7, 4.4])  # away from the foot of the lobes
        rows = np.round(at * RATE).astype(int)
        for row in rows:
            values["displacement"][row : row + length] = reading
        look = Readings(keep(values)).quality
        for row in rows:
            assert not look.valid[row : row + length].any()
        assert np.count_nonzero(~look.valid) <= 3 * (length + 4)
        assert "the reading drops out" in look.findings[0]
        assert "in 3 places" in look.findings[0]

    def test_stress_is_looked_at_too(self, keep):
        values = cycles()
        values["nominal_stress"][450] = 0.0
        values["nominal_stress"][640] = 5e6
        look = Readings(keep(values)).quality
        assert not look.valid[[450, 640]].any()
        assert "kPa from sample 450" in look.findings[0]

    def test_records_carry_the_mask_and_a_line_across_it(self, keep):
        values = lobes()
        values["displacement"][700] = 10e-3
        record = Readings(keep(values)).record
        assert not record.valid[698:703].any()
        assert record.valid[:698].all()
        assert abs(record.measured[700] - values["displacement"][698]) < 50e-6
        assert record.noise == pytest.approx(NOISE, rel=0.3)

    def test_a_comparison_leaves_them_out_of_its_errors(self, keep):
        values = lobes()
        model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
        sound = compare(Readings(keep(values)), model, "validation")
        values["displacement"][700] = 10e-3
        masked = compare(Readings(keep(values)), model, "validation")
        assert masked.errors.max == pytest.approx(sound.errors.max, rel=1e-6)
        assert masked.errors.samples == sound.errors.samples - 5
        assert np.isnan(masked.measured[698:703]).all()
        assert "drops out" in masked.warnings[0]

    def test_a_spike_while_the_film_rings_is_told_by_the_model(self, keep):
        values = lobes()
        model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
        # a step of the voltage, after which the film rings for seconds
        volts = values["voltage_command"] = np.where(values["time"] < 1.0, 0.0, 1.5e3)
        volts[-200:] = 0.0
        moved = model.simulate(Drive(values["time"], volts)).displacement
        values["displacement"] = moved + np.random.default_rng(5).normal(0.0, NOISE, moved.size)
        values["displacement"][300] += 30e-6
        assert np.ptp(np.diff(moved, 2)[280:320]) > 10.0 * NOISE
        recording = keep(values)
        assert Readings(recording).quality.valid is None
        compared = compare(Readings(recording), model, "validation")
        assert np.flatnonzero(np.isnan(compared.measured)).tolist() == [300]
        assert "a single reading is far off the model" in compared.warnings[-1]
        assert compared.errors.rms < 1.2 * NOISE

    def test_an_overlong_fault_is_refused(self, keep):
        values = lobes()
        values["displacement"][400:2300] = 0.1e-3
        with pytest.raises(InputError, match=r"stuck.*less than half of it is usable"):
            _ = Readings(keep(values)).quality


class TestGaps:
    def test_at_rest_a_gap_is_told(self, keep):
        values = lobes()
        values["time"][100:] += 3.0
        look = Readings(keep(values)).quality
        assert "time jumps by 3.004 s after sample 99 (0.396 s)" in look.findings[0]
        assert look.valid is None

    def test_while_driven_it_is_refused(self, keep):
        values = lobes()
        values["time"][400:] += 3.0
        with pytest.raises(InputError, match=r"jumps by 3\.004 s after sample 399.*not known"):
            _ = Readings(keep(values)).quality

    def test_a_change_of_rate_is_no_gap(self, keep):
        values = cycles()
        slow = values["time"] > 20.0
        values["time"] = np.cumsum(np.where(slow, 0.4, 0.04))
        assert Readings(keep(values)).quality.findings == ()


def scaled(values: Values, name: str, factor: float) -> Values:
    return {**values, name: values[name] * factor}


UNITS = {
    "metres for millimetres": (
        scaled(lobes(), "displacement", 1e3),
        ["displacement spans", "mm under 6 kV", "wrong by a thousand"],
    ),
    "micrometres lost": (
        scaled(lobes(), "displacement", 1e-3),
        ["displacement spans only 0.5", "um under 6 kV", "wrong by a thousand"],
    ),
    "kilovolts as volts": (
        scaled(lobes(), "voltage_command", 1e-3),
        ["voltage reaches only 6 V", "sample", "is it in kV"],
    ),
    "volts as kilovolts": (
        scaled(lobes(), "voltage_command", 1e3),
        ["voltage reaches 6000 kV", "sample", "is it in V, and was it imported as kV"],
    ),
    "no voltage": (
        scaled(lobes(), "voltage_command", 0.0),
        ["voltage never leaves 0 V", "amplifier was on"],
    ),
    "a constant voltage": (
        {**lobes(), "voltage_command": np.full(2500, 5e3)},
        ["voltage stands at 5000 V throughout", "start the recording before the voltage"],
    ),
    "stretch in per cent": (
        scaled(cycles(), "stretch", 100.0),
        ["stretch reaches 200", "in per cent"],
    ),
    "strain for stretch": (
        {**cycles(), "stretch": cycles()["stretch"] - 0.99},
        ["stretch is 0.01", "sample 0", "is it a strain"],
    ),
    "stress in kPa": (
        scaled(cycles(), "nominal_stress", 1e-3),
        ["of a modulus of", "kPa or MPa imported as Pa"],
    ),
    "stress a thousandfold": (
        scaled(cycles(), "nominal_stress", 1e3),
        ["of a modulus of", "Pa imported as kPa"],
    ),
    "constant stretch": (
        {**cycles(), "stretch": np.full(1000, 1.5)},
        ["stretch never changes from 1.5"],
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("case", "command"),
    [*((case, "diagnose {f}") for case in UNITS), ("no voltage", "identify {f} --out {d}/m.toml")],
)
def test_what_cannot_be_meant_is_refused_in_words(tmp_path, case, command):
    values, words = UNITS[case]
    path = tmp_path / "run.h5"
    saved(path, values)
    answer = dearig(*(w.format(f=path, d=tmp_path) for w in command.split(" ")))
    assert answer.code == 2, answer.err
    assert answer.err.count("\n") == 1
    assert str(path) in answer.err
    for word in words:
        assert word in answer.err
    assert [p.name for p in tmp_path.iterdir()] == ["run.h5"]


class TestTooShort:
    def test_seconds(self, keep):
        with pytest.raises(InputError, match=r"1\.9\d* s and 4\d\d samples .* too few"):
            check_enough([Readings(keep(lobes(seconds=3.0)))])
        check_enough([Readings(keep(lobes(seconds=6.0)))])

    def test_film(self, keep):
        short = {name: values[:80] for name, values in cycles().items()}
        with pytest.raises(InputError, match="80 samples are too few"):
            check_enough([Readings(keep(short))])


class TestOverlap:
    def cut(self, values: Values, rows: slice) -> Values:
        found = {name: array[rows] for name, array in values.items()}
        return {**found, "time": found["time"] - found["time"][0]}

    def test_an_excerpt_is_known_by_its_samples(self, tmp_path):
        whole = saved(tmp_path / "whole.h5", lobes())
        part = saved(tmp_path / "part.h5", self.cut(lobes(), slice(1200, 2000)))
        there, here = overlap(whole, part)
        assert there - here == pytest.approx(1200 / RATE)
        with pytest.raises(InputError, match=r"part\.h5, to validate, holds .* of .*whole\.h5"):
            check_apart([whole], [part])

    def test_also_after_a_table_has_rounded_it(self, tmp_path):
        whole = saved(tmp_path / "whole.h5", lobes())
        done("export", whole.path, "--to", "csv", "--out", tmp_path / "part.csv")
        table = (tmp_path / "part.csv").read_text().splitlines()
        (tmp_path / "part.csv").write_text("\n".join([table[0], *table[900:2200]]) + "\n")
        done("import", tmp_path / "part.csv", "--out", tmp_path / "part.h5")
        assert overlap(whole, open_recording(tmp_path / "part.h5")) is not None

    def test_another_run_of_the_same_lobes_is_another_run(self, tmp_path):
        one, two = saved(tmp_path / "1.h5", lobes(1)), saved(tmp_path / "2.h5", lobes(2))
        assert overlap(one, two) is None
        check_apart([one], [two])

    def test_runs_of_ours_are_known_by_their_start(self, tmp_path):
        write_run(tmp_path / "one.h5")
        run = open_recording(tmp_path / "one.h5")
        later = replace(run, provenance={**run.provenance, "start_time": "later"})
        assert overlap(run, later) is None
        assert overlap(run, run) is not None


class TestThermometer:
    def test_warmth_is_above_the_first_second(self, keep):
        values = lobes()
        values["temperature"] = 21.0 + 0.1 * np.maximum(values["time"] - 1.0, 0.0)
        drive = Readings(keep(values)).voltage
        assert np.abs(drive.warmth[:120]).max() < 1e-12  # a mean over a second
        assert drive.warmth[-1] == pytest.approx(0.1 * (values["time"][-1] - 1.0), abs=0.02)

    def test_without_one_there_is_none(self, keep):
        assert Readings(keep(lobes())).voltage.warmth is None


class TestWhatGoesBeyondTheTraining:
    def test_a_like_run_does_not(self, tmp_path):
        train = Readings(saved(tmp_path / "train.h5", lobes()))
        assert extrapolated([train], [Readings(saved(tmp_path / "other.h5", lobes(1)))]) == ()

    def test_higher_and_longer_ones_do(self, tmp_path):
        train = Readings(saved(tmp_path / "train.h5", lobes(seconds=4.0)))
        higher = lobes(1)
        higher["voltage_command"] = 1.2 * higher["voltage_command"]
        higher["displacement"] = 1.44 * higher["displacement"]
        long = Readings(saved(tmp_path / "long.h5", lobes(2, seconds=20.0)))
        said = extrapolated([train], [Readings(saved(tmp_path / "higher.h5", higher)), long])
        assert len(said) == 2
        assert "7.2 kV, those that were fitted to 6 kV" in said[0]
        assert "lasts" not in said[0]
        assert "lasts 20 s, those that were fitted 4 s at most" in said[1]

    def test_a_film_that_is_stretched_further_does(self, tmp_path):
        train = Readings(saved(tmp_path / "train.h5", cycles()))
        further = cycles(1)
        further["stretch"] = 1.0 + 2.0 * (further["stretch"] - 1.0)
        (said,) = extrapolated([train], [Readings(saved(tmp_path / "further.h5", further))])
        assert said.startswith("further goes to a stretch of 3, those that were fitted to 2")
        assert said.endswith("its error is extrapolated")
