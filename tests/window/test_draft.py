"""A sequence that is written by hand, step by step, and back."""

from __future__ import annotations

from pathlib import Path

import pytest
import tomli_w

from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.segments import SEGMENT_KINDS
from dearig.config.sequencefile import parse_sequence
from dearig.config.toml_input import parse_toml
from dearig.errors import InputError
from dearig.window.draft import Draft, Place, has_comments, place_of, relative_csv
from dearig.window.fields import form_fields, shown_value, typed_value
from dearig.window.planner import make_preview


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_survives_being_edited(name: str) -> None:
    draft = Draft(PRESETS[name])
    assert draft.toml == PRESETS[name]
    before = parse_sequence(PRESETS[name], name, Path()).sequence
    for tail in (9.0, draft.data.get("tail_s")):
        draft.set_head("tail_s", tail)
    assert parse_sequence(draft.toml, name, Path()).sequence == before


@pytest.mark.parametrize(
    ("toml", "there"),
    [
        ('name = "a"\n', False),
        ("# first\nname = 'a'\n", True),
        ('name = "a" # don\'t\n', True),
        ('name = "a # b"\n', False),
        ("name = 'c:\\' # b\n", True),
        ('name = "\\" # b"\n', False),
        ('name = """\n# "b"\n"""\n', False),
        ("name = '''\n# b\n'''\n", False),
        ('name = "" # "\n', True),
    ],
)
def test_comments_are_told_from_texts(toml: str, there: bool) -> None:
    assert parse_toml(toml, "it")
    assert has_comments(toml) is there


@pytest.mark.parametrize("kind", [k for k in SEGMENT_KINDS if k != "csv"])
def test_a_new_segment_can_be_played_as_it_stands(kind: str) -> None:
    draft = Draft('name = "new"\n')
    draft.add("ramp", 0, to_kV=2.0)
    draft.add(kind, 1)
    if kind not in ("ramp", "hold", "chirp", "multisine", "steps"):
        draft.remove(0)  # those start from 0 V
    draft.add("ramp", len(draft.segments), to_kV=0.0)
    preview = make_preview(draft.toml, Path(), RigFile())
    assert preview.playable, preview.sentence or preview.plan


def test_every_change_can_be_taken_back_and_made_again() -> None:
    draft = Draft(PRESETS["rich"])
    texts = [draft.toml]
    for change in (
        lambda: draft.duplicate(1),
        lambda: draft.move(1, 4),
        lambda: draft.remove(0),
        lambda: draft.set_value(0, "to_kV", 3.0),
        lambda: draft.set_head("lead_in_s", 5.0),
        lambda: draft.add("hold", 2),
        lambda: draft.replace(PRESETS["thesis"]),
    ):
        change()
        assert draft.toml != texts[-1]
        texts.append(draft.toml)
    for text in reversed(texts[:-1]):
        draft.undo()
        assert draft.toml == text
    assert not draft.can_undo
    for text in texts[1:]:
        draft.redo()
        assert draft.toml == text
    assert not draft.can_redo


def test_a_number_that_is_typed_is_one_change() -> None:
    draft = Draft(PRESETS["rich"])
    before = draft.toml
    for value in (1.0, 12.0, 12.5):
        draft.set_value(1, "to_kV", value)
    draft.undo()
    assert draft.toml == before


def test_an_empty_field_leaves_its_key_out() -> None:
    draft = Draft(PRESETS["rich"])
    draft.set_value(2, "offset_kV", 4.0)
    draft.set_value(2, "offset_kV", None)
    assert "offset_kV" not in draft.segments[2]


@pytest.mark.parametrize("text", ["name = ", 'name = "x"\nsegment = 3\n'])
def test_what_is_no_sequence_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        Draft(text)


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"amplitude_kV": "abc"}, Place(2, "amplitude_kV")),
        ({"from_Hz": -1.0}, Place(2, "from_Hz")),
        ({"from_Hz": None}, Place(2, "from_Hz")),
        ({"taper_s": 100.0}, Place(2, None)),
        ({"to_Hz": 900.0}, Place(2, None)),
        ({"offset_kV": 1.0}, Place(2, None)),
        ({"repeats": 1.5}, Place(2, "repeats")),
    ],
)
def test_a_fault_is_found_where_it_is(changes: dict[str, object], place: Place) -> None:
    draft = Draft(PRESETS["rich"])
    for key, value in changes.items():
        draft.set_value(2, key, value)
    preview = make_preview(draft.toml, Path(), RigFile())
    assert preview.sentence
    assert place_of(preview.sentence) == place


@pytest.mark.parametrize(("key", "value"), [("name", ""), ("lead_in_s", -1.0), ("tail_s", "x")])
def test_a_fault_in_the_head_is_found(key: str, value: object) -> None:
    draft = Draft(PRESETS["rich"])
    draft.set_head(key, value)
    assert place_of(make_preview(draft.toml, Path(), RigFile()).sentence) == Place(None, key)


def test_fields_have_words_units_and_bounds() -> None:
    fields = {field.key: field for field in form_fields(SEGMENT_KINDS["chirp"], ("kind",))}
    assert (fields["amplitude_kV"].label, fields["amplitude_kV"].unit) == ("amplitude", "kV")
    assert fields["sweep"].choices == ("exponential", "linear")
    assert "a number above 0" in fields["from_Hz"].tip
    assert fields["taper_s"].default == 0.25


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("amplitude_kV", " 6.5 ", 6.5),
        ("amplitude_kV", "6,5", "6,5"),
        ("amplitude_kV", "", None),
        ("repeats", "3", 3),
        ("repeats", "3.5", 3.5),
        ("sweep", "linear", "linear"),
    ],
)
def test_what_is_typed_is_taken_as_it_is_meant(key: str, text: str, value: object) -> None:
    field = next(f for f in form_fields(SEGMENT_KINDS["chirp"]) if f.key == key)
    assert typed_value(field, text) == value
    assert type(typed_value(field, text)) is type(value)


def test_a_list_is_typed_with_commas_or_blanks() -> None:
    field = next(f for f in form_fields(SEGMENT_KINDS["steps"]) if f.key == "levels_kV")
    assert typed_value(field, "3, 7;5 8") == [3.0, 7.0, 5.0, 8.0]
    assert typed_value(field, ".5,-1 ,2; 3 ;, 4") == [0.5, -1.0, 2.0, 3.0, 4.0]
    assert shown_value([3.0, 0.1]) == "3, 0.1"


@pytest.mark.parametrize("text", ["4,5; 7,5; 0", "4,5 7,5 0", "4,5", "4,5, 7,5, 0", "1,2,3"])
def test_decimal_commas_in_a_list_are_refused_as_in_one_number(text: str) -> None:
    """Half of Europe writes them; as separators they would make other voltages."""
    field = next(f for f in form_fields(SEGMENT_KINDS["steps"]) if f.key == "levels_kV")
    levels = typed_value(field, text)
    assert levels[0] in ("4,5", "1,2,3")
    toml = tomli_w.dumps(
        {"name": "x", "segment": [{"kind": "steps", "dwell_s": 1.0, "levels_kV": levels}]}
    )
    with pytest.raises(InputError, match=r'levels_kV\[1\] = "(4,5|1,2,3)" is not allowed'):
        parse_sequence(toml, "the form", Path())


def test_what_breaks_a_limit_is_marked_where_it_does() -> None:
    toml = (
        'name = "fast"\n[[segment]]\nkind = "ramp"\nto_kV = 8.0\nduration_s = 0.004\n'
        '[[segment]]\nkind = "ramp"\nto_kV = 0.0\nduration_s = 1.0\n'
    )
    preview = make_preview(toml, Path(), RigFile())
    assert not preview.playable
    (breach,) = preview.breaches
    assert breach.quantity == "slew"
    assert breach.first == pytest.approx(2.0, abs=2e-3)
    assert breach.last == pytest.approx(2.004, abs=2e-3)
    assert [s[0] for s in preview.segments] == [
        "lead-in", "ramp (1 of 2)", "ramp (2 of 2)", "tail",
    ]  # fmt: skip


def test_a_csv_is_named_as_short_as_it_can_be(tmp_path: Path) -> None:
    assert relative_csv(tmp_path / "w.csv", tmp_path) == "w.csv"
    assert relative_csv(tmp_path / "w.csv", tmp_path / "other") == (tmp_path / "w.csv").as_posix()
