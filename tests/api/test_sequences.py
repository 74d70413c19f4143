"""Sequences are built in code, from files and from presets, and refused like those of files."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import dearig


def lobes() -> dearig.Sequence:
    start = dearig.Sequence("lobes", lead_in_s=1.0, tail_s=0.5)
    return start.half_sine(amplitude_kV=6.0, frequency_Hz=1.0, repeats=3).hold(duration_s=2.0)


def test_segments_are_added_in_order_and_the_first_sequence_stays() -> None:
    start = dearig.Sequence("lobes")
    longer = start.ramp(to_kV=4.0, duration_s=1.0).ramp(to_kV=0.0, duration_s=0.5)
    assert longer.duration_s == pytest.approx(2.0 + 1.5 + 1.0)  # with lead-in and tail
    with pytest.raises(dearig.InputError, match="has no segments: add one"):
        start.toml  # noqa: B018


def test_a_sequence_that_does_not_end_at_0_is_refused_when_it_is_used() -> None:
    up = dearig.Sequence("up").ramp(to_kV=4.0, duration_s=1.0)
    with pytest.raises(dearig.InputError, match="put a ramp to 0 at the end"):
        up.sample(1000.0)


def test_a_sequence_is_sampled_in_volts() -> None:
    time, voltage = lobes().sample(1000.0)
    assert time[-1] == pytest.approx(lobes().duration_s, abs=1e-3)
    assert voltage.max() == pytest.approx(6000.0, rel=1e-4)
    assert not voltage[time < 1.0].any()


def test_a_sequence_comes_back_from_its_file_and_from_its_text(tmp_path: Path) -> None:
    path = lobes().save(tmp_path / "lobes.toml")
    for again in (dearig.Sequence.open(path), dearig.Sequence.from_toml(lobes().toml)):
        np.testing.assert_array_equal(again.sample(500.0)[1], lobes().sample(500.0)[1])
        assert again.name == "lobes"
    with pytest.raises(dearig.InputError, match="exists already"):
        lobes().save(path)


def test_arrays_and_tuples_are_taken_as_lists() -> None:
    made = dearig.Sequence("steps").steps(
        levels_kV=np.array([1.0, 2.0, 0.0]), dwell_s=np.float64(0.5), rise_s=0.05
    )
    same = dearig.Sequence("steps").steps(levels_kV=(1.0, 2.0, 0.0), dwell_s=0.5, rise_s=0.05)
    assert made.toml == same.toml


def test_presets_are_opened_by_name_and_can_be_continued() -> None:
    preset = dearig.Sequence.open("validation-a-1.0")
    assert "validation-a-1.0" in dearig.Sequence.presets()
    assert preset.hold(duration_s=3.0).duration_s == pytest.approx(preset.duration_s + 3.0)


@pytest.mark.parametrize("kind", dearig.Sequence.kinds())
def test_every_kind_is_a_method_that_says_what_it_takes(kind: str) -> None:
    method = getattr(dearig.Sequence("x"), kind)
    assert kind in dir(dearig.Sequence("x"))
    assert set(inspect.signature(method).parameters) == set(
        re.findall(r"^(\w+) :", method.__doc__, re.MULTILINE)
    )


def test_a_wrong_key_value_or_kind_is_said_in_a_sentence() -> None:
    start = dearig.Sequence("x")
    with pytest.raises(dearig.InputError, match=r"segment 1 \(half_sine\).*amplitude_V is not"):
        start.half_sine(amplitude_V=6000.0, frequency_Hz=1.0)
    with pytest.raises(dearig.InputError, match="frequency_Hz"):
        start.half_sine(amplitude_kV=6.0, frequency_Hz=-1.0)
    with pytest.raises(AttributeError, match=r"no attribute 'haf_sine'; .* half_sine, "):
        start.haf_sine(amplitude_kV=1.0)
    with pytest.raises(dearig.InputError, match="kind"):
        start.add("haf_sine")


def test_a_sequence_shows_itself(tmp_path: Path) -> None:
    assert repr(lobes()) == "<Sequence 'lobes': half_sine, hold>"
    html = lobes()._repr_html_()
    assert "half_sine, hold" in html
    assert "<svg" in html
    assert "segments" in dearig.Sequence("empty")._repr_html_()
    page = lobes().to_html(tmp_path / "lobes.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert lobes().plot().axes[0].lines[0].get_ydata().max() == pytest.approx(6.0, rel=1e-3)
