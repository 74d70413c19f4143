"""Sequence files: what each kind of segment plays, and what a recording keeps of it."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

from dearig.config.presets import PRESETS
from dearig.config.sequencefile import (
    HELD_SAMPLES_MAX,
    SAMPLES_MAX,
    load_sequence,
    parse_sequence,
    read_sequence,
)
from dearig.errors import InputError
from dearig.model.simulation.excitation import Sequence

HEAD = 'name = "x"\nlead_in_s = 0.1\ntail_s = 0.1\n'


def sampled(text: str, folder: Path = Path()) -> np.ndarray:
    _, voltage = parse_sequence(HEAD + text, "x", folder).sample(1000.0)
    return voltage


def test_the_defaults_are_the_thesis() -> None:
    loaded = parse_sequence('name = "x"\n[[segment]]\nkind = "thesis"\n', "x", Path())
    np.testing.assert_array_equal(loaded.sample(1000.0)[1], Sequence.thesis().sample(1000.0)[1])
    # the quiet frame, in which the noise floor is read
    assert (loaded.sequence.lead_in, loaded.sequence.tail) == (2.0, 1.0)


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_starts_and_ends_at_0_volts(name: str) -> None:
    time, voltage = load_sequence(name).sample(500.0)
    assert voltage[0] == voltage[-1] == 0.0
    assert voltage.min() >= 0.0
    assert 7.9e3 <= voltage.max() <= 8.0e3 or name.startswith("validation-b")
    assert time[1] == 0.002


@pytest.mark.parametrize(
    ("keys", "samples", "peak"),
    [
        ('kind = "half_sine"\namplitude_kV = 2.0\nfrequency_Hz = 2.0', 701, 2000.0),
        ('kind = "triangle"\namplitude_kV = 2.0\nfrequency_Hz = 2.0\nrepeats = 3', 1701, 2000.0),
        ('kind = "steps"\nlevels_kV = [1.0, 3.0, 0.0]\ndwell_s = 0.5', 1701, 3000.0),
        ('kind = "sine"\namplitude_kV = 2.0\nfrequency_Hz = 2.0\ncycles = 4.0', 2201, 2000.0),
        (
            'kind = "chirp"\namplitude_kV = 1.0\nfrom_Hz = 1.0\nto_Hz = 20.0\nduration_s = 2.0',
            2201,
            1000.0,
        ),
        (
            'kind = "multisine"\namplitude_kV = 1.0\nfrequencies_Hz = [1.0, 3.0]\nduration_s = 2',
            2201,
            1000.0,
        ),
    ],
)
def test_kinds_of_segment(keys: str, samples: int, peak: float) -> None:
    voltage = sampled(f"[[segment]]\n{keys}\n")
    assert voltage.size == samples
    assert np.abs(voltage).max() == pytest.approx(peak, rel=0.02)


def test_a_start_that_is_left_out_is_where_the_segment_before_ended() -> None:
    voltage = sampled(
        '[[segment]]\nkind = "ramp"\nto_kV = 2.0\nduration_s = 0.1\n'
        '[[segment]]\nkind = "hold"\nduration_s = 0.1\n'
        '[[segment]]\nkind = "ramp"\nto_kV = 0.0\nduration_s = 0.1\n'
    )
    assert voltage[150] == pytest.approx(1000.0)
    assert voltage[250] == 2000.0
    assert voltage[350] == pytest.approx(1000.0)


@pytest.mark.parametrize(("column", "factor"), [("voltage_V", 1.0), ("voltage_kV", 1e3)])
def test_a_waveform_from_csv(tmp_path: Path, column: str, factor: float) -> None:
    text = f"time_s,{column}\n5.0,0\n5.1,{3000.0 / factor}\n5.3,0\n"
    (tmp_path / "w.csv").write_text(text, encoding="utf-8", newline="\n")
    toml = HEAD + '[[segment]]\nkind = "csv"\nfile = "w.csv"\n'
    loaded = parse_sequence(toml, "x", tmp_path)
    _, voltage = loaded.sample(1000.0)
    assert voltage[200] == pytest.approx(3000.0)
    assert voltage[300] == pytest.approx(1500.0)
    # the recording keeps the sequence, and which file it played
    digest = hashlib.sha256((tmp_path / "w.csv").read_bytes()).hexdigest()
    assert loaded.toml == f"{toml}# segment 1: w.csv had sha256 {digest}\n"


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("time_s,voltage_kV,voltage_V", "voltage_kV and voltage_V"),
        ("time_s,voltage_kV,voltage_kV", "voltage_kV and voltage_kV #3"),
        ("time_s,voltage_kV,time_s", "time_s and time_s #3"),
    ],
)
def test_a_waveform_with_two_voltages_or_times_is_refused(
    tmp_path: Path, head: str, said: str
) -> None:
    # which of the two the operator has edited is not known
    (tmp_path / "w.csv").write_text(f"{head}\n0,0,0\n1,1.5,3\n2,0,0\n", encoding="utf-8")
    toml = HEAD + '[[segment]]\nkind = "csv"\nfile = "w.csv"\n'
    with pytest.raises(InputError, match=f"{said}, which may contradict"):
        parse_sequence(toml, "x", tmp_path)


def test_a_run_as_long_as_it_may_be() -> None:
    text = 'name = "x"\nlead_in_s = 0.0\ntail_s = 0.0\n[[segment]]\nkind = "hold"\nduration_s = '
    longest = SAMPLES_MAX / 1000.0
    loaded = parse_sequence(f"{text}{longest}\n", "x", Path())
    assert loaded.on_clock(1000.0).samples == SAMPLES_MAX + 1
    assert not loaded.on_clock(1000.0).window(SAMPLES_MAX - 9, SAMPLES_MAX + 1).any()
    with pytest.raises(InputError, match=f"at most {SAMPLES_MAX:,} can be played"):
        parse_sequence(f"{text}{longest + 1.0}\n", "x", Path()).on_clock(1000.0)


def test_a_sequence_held_whole_is_shorter() -> None:
    text = 'name = "x"\nlead_in_s = 0.0\ntail_s = 0.0\n[[segment]]\nkind = "hold"\nduration_s = '
    longest = HELD_SAMPLES_MAX / 1000.0
    loaded = parse_sequence(f"{text}{longest + 1.0}\n", "x", Path())
    assert loaded.sample(10.0)[1].size == (longest + 1.0) * 10 + 1
    with pytest.raises(InputError, match=f"at most {HELD_SAMPLES_MAX:,} can be played"):
        loaded.sample(1000.0)


def test_faults_that_a_wrong_name_causes_are_not_counted() -> None:
    text = f'{HEAD}[[segment]]\nkind = "hold"\nduration_ms = 3.0\n'
    with pytest.raises(InputError, match=r"in s, as duration_s$"):
        parse_sequence(text, "x", Path())
    text += "colour = 3\n"
    with pytest.raises(InputError, match=r"\(1 more fault after that\)$"):
        parse_sequence(text, "x", Path())


def test_every_fault_of_a_sequence_is_told_with_its_place() -> None:
    text = (
        'name = ""\ntail_s = -1.0\n'
        '[[segment]]\nkind = "hold"\nduration_s = -1.0\nvoltage_kV = "x"\n'
        '[[segment]]\nkind = "csv"\nfile = "missing.csv"\n'
        '[[segment]]\nkind = "unknown"\n'
        '[[segment]]\nkind = "hold"\n'
    )
    loaded, faults = read_sequence(text, "x", Path())
    assert loaded is None
    assert {(f.row, f.key) for f in faults} == {
        (None, "name"), (None, "tail_s"), (0, "duration_s"), (0, "voltage_kV"), (1, None),
        (2, None), (3, "duration_s"),
    }  # fmt: skip
    assert all(f.words in f.sentence or f.key for f in faults)


def test_every_segment_that_does_not_join_is_told_by_its_row() -> None:
    hold = '[[segment]]\nkind = "hold"\nduration_s = 1.0\nvoltage_kV = '
    text = f"{HEAD}{hold}0.0\nrepeats = 3\n{hold}2.0\n{hold}1.0\n"
    loaded, faults = read_sequence(text, "x", Path())
    assert loaded is None
    assert [f.row for f in faults] == [1, 2, 2]
    assert faults[0].sentence.startswith("segment 4 (hold) starts at 2 kV")
    assert "ends at 1 kV but the run ends at 0 kV" in faults[2].sentence


def test_every_segment_that_is_too_fast_for_the_clock_is_told() -> None:
    sine = '[[segment]]\nkind = "half_sine"\namplitude_kV = 1.0\nfrequency_Hz = '
    loaded = parse_sequence(f"{HEAD}{sine}600.0\n{sine}1.0\n{sine}700.0\n", "x", Path())
    assert [fault.row for fault in loaded.clock_faults(1000.0)] == [0, 2]
