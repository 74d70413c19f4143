"""The rig file as a form: what is wrong stands where it is, and the rest is left as it was."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from dearig.config.rigfile import RigFile, load_rig_file, write_default
from dearig.config.rigform import SECTIONS, faults_of, parse_rig_file, section_values
from dearig.config.toml_edit import with_key
from dearig.errors import InputError


@pytest.fixture
def default(tmp_path: Path) -> str:
    write_default(tmp_path / "rig.toml")
    return (tmp_path / "rig.toml").read_text(encoding="utf-8")


def test_a_written_file_is_what_is_parsed(default: str, tmp_path: Path) -> None:
    assert parse_rig_file(default) == load_rig_file(tmp_path / "rig.toml") == RigFile()
    assert parse_rig_file("") == RigFile()


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("film", "length_mm", 80.0),
        ("film", "name", 'VHB "4910" # 3'),
        ("load", "rest_length_mm", 82.0),
        ("laser", "direction", -1),
        ("thermometer", "model", "Pt100"),
        ("card", "do_hv_enable", "port0/line0"),
    ],
)
def test_one_value_is_changed_and_nothing_else(
    default: str, table: str, key: str, value: Any
) -> None:
    changed = with_key(default, table, key, value)
    wanted = tomllib.loads(default)
    wanted.setdefault(table, {})[key] = value
    assert tomllib.loads(changed) == wanted
    kept = [line for line in default.splitlines() if line.startswith("#")]
    assert [line for line in changed.splitlines() if line.startswith("#")] == kept
    again = with_key(changed, table, key, None)
    wanted[table].pop(key)
    assert tomllib.loads(again) == wanted


def test_a_remark_behind_a_value_stays() -> None:
    text = '[film]\nlength_mm = 75.0  # of 3 May\nname = "a # b" # ours\n[load]\nmass_g = 1.0'
    text = with_key(with_key(text, "film", "length_mm", 76.0), "film", "name", "c")
    assert 'length_mm = 76.0  # of 3 May\nname = "c" # ours\n[load]' in text
    assert tomllib.loads(with_key(text, "load", "mass_g", 2.0))["load"] == {"mass_g": 2.0}


def test_a_key_of_another_table_is_left_alone() -> None:
    text = '[amplifier]\nmodel = "A"\n[laser]\nmodel = "L"\n'
    changed = tomllib.loads(with_key(text, "laser", "model", "M"))
    assert changed == {"amplifier": {"model": "A"}, "laser": {"model": "M"}}


def test_what_is_wrong_stands_at_its_key() -> None:
    text = '[film]\nlength_mm = "x"\n[limits]\nvoltage_max_kV = -1.0\n[laser]\naveraging = 17\n'
    faults = faults_of(text)
    assert set(faults) == {
        ("film", "length_mm"), ("limits", "voltage_max_kV"), ("laser", "averaging"),
    }  # fmt: skip
    assert "a number above 0" in faults["film", "length_mm"]
    assert "the controller offers 1, 4, 16" in faults["laser", "averaging"]
    with pytest.raises(InputError, match="the controller offers"):
        parse_rig_file(text)


def test_what_two_keys_do_not_agree_on_stands_at_the_one_that_is_named() -> None:
    faults = faults_of("[limits]\nvoltage_max_kV = 12.0\n")
    assert set(faults) == {("limits", "voltage_max_kV")}
    assert "the amplifier's range" in faults["limits", "voltage_max_kV"]


def test_what_single_keys_and_several_keys_have_wrong_is_told_at_once() -> None:
    text = (
        '[film]\nlength_mm = 75.0\n[laser]\naveraging = "x"\n[load]\nrest_length_mm = 70.0\n'
        "[limits]\nvoltage_max_kV = 12.0\nslew_max_kV_per_s = 1e6\n"
    )
    faults = faults_of(text)
    assert set(faults) == {
        ("laser", "averaging"), ("load", "rest_length_mm"), ("limits", "voltage_max_kV"),
        ("limits", "slew_max_kV_per_s"),
    }  # fmt: skip
    # what rest on a key that is itself wrong is not told of the key that stands in its place
    wrong = faults_of('[film]\nlength_mm = "x"\n[load]\nrest_length_mm = 70.0\n')
    assert set(wrong) == {("film", "length_mm")}


def test_unknown_keys_and_tables_are_said() -> None:
    faults = faults_of("[film]\nlenght_mm = 3.0\n[foo]\n")
    assert "film.lenght_mm is not a key" in faults["film", "lenght_mm"]
    assert "foo is not a key" in faults["foo", ""]


def test_text_that_is_no_toml_is_refused() -> None:
    with pytest.raises(InputError, match="line 1"):
        faults_of("[film")


def test_values_are_those_of_the_file() -> None:
    assert section_values("[film]\nlength_mm = 3.0\n", "film") == {"length_mm": 3.0}
    assert section_values("film = 3\n", "film") == {}
    assert list(SECTIONS)[:2] == ["film", "load"]
