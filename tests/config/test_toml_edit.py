"""Files are edited in place: what no one changed stays to the letter."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dearig.config.toml_edit import split_segments, with_key, written_anew
from tests.deep import examples

RIG = """\
# our rig

[film]  # no. 7
length_mm = 75.0   # of 3 May
# width_mm = 72.0
name = 'a # b'

# the load
[load]
mass_g = 200
"""


def test_one_line_changes() -> None:
    changed = with_key(RIG, "film", "length_mm", 76.5)
    assert changed == RIG.replace("75.0", "76.5")
    assert with_key(changed, "film", "length_mm", 75.0) == RIG


def test_a_new_key_stands_below_its_comment_or_the_last_key() -> None:
    assert "# width_mm = 72.0\nwidth_mm = 60.0\nname" in with_key(RIG, "film", "width_mm", 60.0)
    assert "name = 'a # b'\ndensity_kg_m3 = 900.0\n\n# the load" in with_key(
        RIG, "film", "density_kg_m3", 900.0
    )
    assert with_key(RIG, "laser", "averaging", 16).endswith("\n\n[laser]\naveraging = 16\n")


def test_a_key_that_is_removed_takes_its_line_along() -> None:
    assert with_key(RIG, "film", "name", None) == RIG.replace("name = 'a # b'\n", "")
    assert with_key(RIG, "film", "absent", None) == RIG
    assert with_key(RIG, "absent", "key", None) == RIG


@pytest.mark.parametrize(
    "text",
    [
        "film.length_mm = 3  # c\n",
        "film = {length_mm = 3}  # c\n",
        '"film".length_mm = 3 # c\n[load]\n',
        "# c\r\n[film]\r\nlength_mm = 3\r\n",
        "[ film ] # c\nlength_mm = [\n 1,\n 2,\n]\n",
        '[film] # c\nlength_mm = """\n[load]\n"""\n[load]\n',
        "[film.inner]\na = 1 # c\n",
        "[film] # c",
        "film.a = 1 # c\n[load]\nb = 2\n[film.x]\n",
    ],
)
@pytest.mark.parametrize("key", ["length_mm", "width_mm"])
def test_every_way_to_write_a_table_is_edited(text: str, key: str) -> None:
    wanted = tomllib.loads(text)
    wanted["film"][key] = 4.5
    changed = with_key(text, "film", key, 4.5)
    assert tomllib.loads(changed) == wanted
    assert "# c" in changed


SEQUENCE = """\
# title

name = "x"  # n
# the first
[[segment]]
kind = "ramp"   # up
to_kV = [1.0,
  2.0, # two
]
# taper_s = 2

# about two
[[segment]]
kind = "hold"
duration_s = 1.50

# at the end
"""


def test_the_comments_of_a_segment_go_with_it() -> None:
    texts = split_segments(SEQUENCE)
    assert texts is not None
    assert texts.toml == SEQUENCE
    first, second = texts.segments
    assert first.startswith("# the first\n[[segment]]")
    assert first.endswith("# taper_s = 2\n\n")
    assert second.startswith("# about two\n[[segment]]")
    assert texts.moved(0, 1).segments == (second, first)
    assert texts.without(0).toml == SEQUENCE.replace(first, "")
    assert texts.with_copy(1).segments == (first, second, second)
    assert texts.with_segment(1, {"kind": "hold"}).segments[1] == '[[segment]]\nkind = "hold"\n\n'
    assert (
        texts.with_value(0, "taper_s", 3.0).segments[0].endswith("# taper_s = 2\ntaper_s = 3.0\n\n")
    )
    assert texts.with_head("tail_s", 2.0).head == '# title\n\nname = "x"  # n\ntail_s = 2.0\n'


@pytest.mark.parametrize(
    "text",
    [
        'name = "x"\nsegment = [{kind = "hold"}]\n',
        'name = """\n[[segment]]\n"""\n[[segment]]\nkind = "hold"\n',
        'name = "x"\n[[segment]]\nkind = "hold"\n[other]\na = 1\n',
    ],
)
def test_what_is_not_written_as_tables_is_not_cut(text: str) -> None:
    assert split_segments(text) is None


def test_a_text_that_is_written_anew_keeps_all_comments() -> None:
    text = "# a\nx = 'it # is' # b\ny = [1, # c\n]\n"
    assert written_anew({"x": 1}, text) == "# a\n# b\n# c\nx = 1\n"


keys = st.sampled_from(["amplitude_kV", "frequency_Hz", "repeats", "name"])
values = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False), st.integers(-(2**62), 2**62), st.text(),
    st.lists(st.floats(-10.0, 10.0), max_size=3), st.booleans(),
)  # fmt: skip


@examples(100, suite=25)
@given(st.lists(st.tuples(st.integers(0, 1), keys, st.one_of(values, st.none())), max_size=5))
def test_any_edits_give_the_tables_that_are_wanted(edits: list[tuple[int, str, Any]]) -> None:
    texts = split_segments(SEQUENCE)
    wanted = tomllib.loads(SEQUENCE)
    assert texts is not None
    for row, key, value in edits:
        texts = texts.with_value(row, key, value)
        if value is None:
            wanted["segment"][row].pop(key, None)
        else:
            wanted["segment"][row][key] = value
    assert tomllib.loads(texts.toml) == wanted
    for comment in (
        "# title",
        "# n",
        "# the first",
        "# up",
        "# two",
        "# about two",
        "# at the end",
    ):
        assert comment in texts.toml
