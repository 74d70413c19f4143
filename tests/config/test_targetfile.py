"""Targets: sequences of a displacement in millimetres, and tables."""

import numpy as np
import pytest

from dearig.config.segments import SEGMENT_KINDS
from dearig.config.targetfile import EXAMPLE, load_target, parse_target
from dearig.errors import InputError
from tests.tools.command import write

RATE = 100.0


def target(segments, head='name = "path"\n'):
    return head + "".join(f"[[segment]]\n{text}\n" for text in segments)


def parsed(tmp_path, *segments):
    return parse_target(target(segments), "path.toml", tmp_path)


def test_the_example_is_a_path_in_metres():
    _, path, lead_in, tail = parse_target(EXAMPLE, "example", None).sample(RATE)
    assert path.max() == pytest.approx(0.5e-3)
    assert not path[:lead_in].any()
    assert not path[path.size - tail :].any()
    assert (lead_in / RATE, tail / RATE) == (2.0, 1.0)


@pytest.mark.parametrize("kind", [k for k in SEGMENT_KINDS if k != "csv"])
def test_every_kind_of_segment_is_in_millimetres(kind, tmp_path):
    example = SEGMENT_KINDS[kind].example
    names = {k.replace("voltage_kV", "displacement_mm").replace("_kV", "_mm"): v
             for k, v in example.items()}  # fmt: skip
    keys = [f'kind = "{kind}"', *(f"{k} = {v}" for k, v in names.items())]
    _, path, _, _ = parsed(tmp_path, "\n".join(keys)).sample(1000.0)
    assert np.isfinite(path).all()
    assert np.abs(path).max() < 0.1  # m: millimetres, not kilovolts


def test_a_table_is_a_target(tmp_path):
    table = write(tmp_path / "walk.csv", "time_s,displacement_um\n0,0\n1,400\n3,0\n")
    found = load_target(table)
    time, path, lead_in, _ = found.sample(RATE)
    assert found.name == "walk"
    assert path.max() == pytest.approx(400e-6)
    assert time[np.argmax(path)] == pytest.approx(lead_in / RATE + 1.0)


def test_a_table_of_voltage_is_no_target(tmp_path):
    table = write(tmp_path / "walk.csv", "time_s,voltage_kV\n0,0\n1,4\n3,0\n")
    with pytest.raises(InputError, match="takes time_s and displacement_mm"):
        load_target(table)


@pytest.mark.parametrize(
    ("segment", "words"),
    [
        ('kind = "hold"\nvoltage_kV = 1.0\nduration_s = 1.0', "write displacement_mm"),
        ('kind = "ramp"\nto_kV = 1.0\nduration_s = 1.0', "write to_mm"),
        ('kind = "ramp"\nto_mm = "x"\nduration_s = 1.0', 'to_mm = "x" is not allowed'),
        ('kind = "ramp"\nto_mm = 0.4\nduration_s = 1.0', "ends at 0.4 mm but the run ends at 0 mm"),
        ('kind = "leap"', 'kind = "leap" is not known'),
        ('kind = "hold"', "duration_s is missing"),
    ],
)
def test_a_wrong_target_is_one_sentence_in_millimetres(segment, words, tmp_path):
    with pytest.raises(InputError) as refused:
        parsed(tmp_path, segment)
    assert words in str(refused.value)
    assert "kV" not in str(refused.value).replace("voltage_kV", "").replace("to_kV", "")


def test_the_name_of_a_file_stays_as_it_is(tmp_path):
    with pytest.raises(InputError, match=r"my voltage\.kV\.csv"):
        parsed(tmp_path, 'kind = "csv"\nfile = "my voltage.kV.csv"')


def test_a_target_names_only_files_beside_it(tmp_path):
    with pytest.raises(InputError, match="leads out of the sequence's folder"):
        parsed(tmp_path, 'kind = "csv"\nfile = "../walk.csv"')
