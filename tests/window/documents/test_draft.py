"""A sequence that is written by hand, step by step, and back."""

from __future__ import annotations

from pathlib import Path

import pytest

from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.segments import SEGMENT_KINDS
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError
from dearig.window.documents.draft import Draft, relative_csv
from dearig.window.kit.fields import form_fields, read_back, read_typed, shown_value
from dearig.window.sequence.planner import make_preview


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_survives_being_edited(name: str) -> None:
    draft = Draft(PRESETS[name])
    assert draft.toml == PRESETS[name]
    before = parse_sequence(PRESETS[name], name, Path()).sequence
    for tail in (9.0, draft.data.get("tail_s")):
        draft.set_head("tail_s", tail)
    assert parse_sequence(draft.toml, name, Path()).sequence == before


@pytest.mark.parametrize("kind", [k for k in SEGMENT_KINDS if k != "csv"])
def test_a_new_segment_can_be_played_as_it_stands(kind: str) -> None:
    draft = Draft('name = "new"\n')
    draft.add(0, "ramp", {"to_kV": 2.0, "duration_s": 1.0})
    draft.add(1, kind, SEGMENT_KINDS[kind].example)
    if kind not in ("ramp", "hold", "chirp", "multisine", "steps"):
        draft.remove(0)  # those start from 0 V
    draft.add(len(draft.segments), "ramp", {"to_kV": 0.0, "duration_s": 1.0})
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
        lambda: draft.add(2, "hold", {"duration_s": 1.0}),
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
    ("changes", "key"),
    [
        ({"amplitude_kV": "abc"}, "amplitude_kV"),
        ({"from_Hz": -1.0}, "from_Hz"),
        ({"from_Hz": None}, "from_Hz"),
        ({"taper_s": 100.0}, None),
        ({"to_Hz": 900.0}, None),
        ({"offset_kV": 1.0}, None),
        ({"repeats": 1.5}, "repeats"),
    ],
)
def test_a_fault_is_found_where_it_is(changes: dict[str, object], key: str | None) -> None:
    draft = Draft(PRESETS["rich"])
    for name, value in changes.items():
        draft.set_value(2, name, value)
    preview = make_preview(draft.toml, Path(), RigFile())
    assert preview.sentence
    assert (2, key) in [(fault.row, fault.key) for fault in preview.faults]


@pytest.mark.parametrize(("key", "value"), [("name", ""), ("lead_in_s", -1.0), ("tail_s", "x")])
def test_a_fault_in_the_head_is_found(key: str, value: object) -> None:
    draft = Draft(PRESETS["rich"])
    draft.set_head(key, value)
    (fault,) = make_preview(draft.toml, Path(), RigFile()).faults
    assert (fault.row, fault.key) == (None, key)


def test_every_fault_is_told_at_once_with_what_exceeds_a_limit() -> None:
    draft = Draft(PRESETS["rich"])
    draft.set_head("lead_in_s", -1.0)
    draft.set_value(1, "duration_s", -1.0)
    draft.set_value(2, "taper_s", 100.0)
    draft.set_value(4, "levels_kV", [3.0, 12.5, 9.0, 0.0])
    faults = {(f.row, f.key): f.words for f in make_preview(draft.toml, Path(), RigFile()).faults}
    assert set(faults) == {
        (None, "lead_in_s"), (1, "duration_s"), (2, None), (4, "levels_kV")
    }  # fmt: skip
    assert faults[4, "levels_kV"].startswith("value 2 (12.5 kV), value 3 (9 kV) are above 8.5 kV")


def test_every_row_and_field_beyond_a_limit_is_marked() -> None:
    toml = (
        'name = "x"\n[[segment]]\nkind = "half_sine"\namplitude_kV = 9.0\nfrequency_Hz = 1.0\n'
        "repeats = 2\n"
        '[[segment]]\nkind = "hold"\nduration_s = 0.5\n'
        '[[segment]]\nkind = "ramp"\nto_kV = 5.0\nduration_s = 0.003\n'
        '[[segment]]\nkind = "sine"\namplitude_kV = 4.9\noffset_kV = 5.0\nfrequency_Hz = 1.0\n'
        '[[segment]]\nkind = "ramp"\nto_kV = 0.0\nduration_s = 1.0\n'
    )
    preview = make_preview(toml, Path(), RigFile())
    assert preview.plan is not None
    assert not preview.playable
    faults = {(f.row, f.key): f.words for f in preview.faults}
    assert set(faults) == {
        (0, None), (0, "amplitude_kV"), (2, None), (3, None), (3, "amplitude_kV"), (3, "offset_kV"),
    }  # fmt: skip
    assert faults[0, None] == "voltage reaches 9 kV, 8.5 kV is allowed"
    assert "9 kV is above 8.5 kV, the limit of the rig file" in faults[0, "amplitude_kV"]
    assert faults[2, None].startswith("slew reaches 16")
    assert "voltage reaches 9.9 kV" in faults[3, None]
    assert "with the other fields" in faults[3, "offset_kV"]


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
        ("amplitude_kV", "6,5", 6.5),
        ("amplitude_kV", "1,500", "1,500"),
        ("amplitude_kV", "", None),
        ("repeats", "3", 3),
        ("repeats", "3.5", 3.5),
        ("sweep", "linear", "linear"),
    ],
)
def test_what_is_typed_is_taken_as_it_is_meant(key: str, text: str, value: object) -> None:
    field = next(f for f in form_fields(SEGMENT_KINDS["chirp"]) if f.key == key)
    read = read_typed(field, text)
    assert read.value == value
    assert type(read.value) is type(value)
    assert bool(read.fault) == (text == "1,500")


def test_what_was_read_is_shown_with_its_unit() -> None:
    field = next(f for f in form_fields(SEGMENT_KINDS["steps"]) if f.key == "levels_kV")
    assert read_back(field, read_typed(field, "6,5; 7").value) == "6.5, 7 kV: 2 values"
    assert read_back(field, read_typed(field, "7").value) == "7 kV: 1 value"
    assert read_back(field, read_typed(field, "6,5").value) == ""  # it may be two values
    assert read_typed(field, "6,5").value == "6,5"  # kept as text, which no sequence takes
    dwell = next(f for f in form_fields(SEGMENT_KINDS["steps"]) if f.key == "dwell_s")
    assert read_back(dwell, 0.25) == "= 0.25 s"
    assert shown_value([3.0, 0.1]) == "3, 0.1"


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


COMMENTED = """\
# ageing, film 7

name = "a"  # short
# up
[[segment]]
kind = "ramp"   # slow
to_kV = 2.50
duration_s = 1.0

# and back
[[segment]]
kind = "ramp"
to_kV = 0.0
duration_s = 1.0
"""


def test_a_changed_sequence_keeps_comments_order_and_letters() -> None:
    draft = Draft(COMMENTED)
    draft.set_value(1, "duration_s", 3.0)
    assert draft.toml == COMMENTED[:-4] + "3.0\n"
    draft.set_value(0, "duration_s", 2.0)
    assert draft.toml == COMMENTED.replace("duration_s = 1.0", "duration_s = 2.0", 1)[:-4] + "3.0\n"
    draft.move(1, 0)
    assert draft.toml.index("# and back") < draft.toml.index("# up")
    draft.remove(1)
    assert "# up" not in draft.toml
    assert "# ageing, film 7" in draft.toml
    for _ in range(4):
        draft.undo()
    assert draft.toml == COMMENTED


def test_segments_in_one_array_are_edited_below_the_comments() -> None:
    draft = Draft('# why\nname = "a"\nsegment = [{kind = "hold", duration_s = 1.0}]  # so\n')
    draft.set_value(0, "duration_s", 2.0)
    assert draft.toml.startswith("# why\n# so\n")
    assert draft.toml.endswith('[[segment]]\nkind = "hold"\nduration_s = 2.0\n')


def test_a_csv_is_named_as_short_as_it_can_be(tmp_path: Path) -> None:
    assert relative_csv(tmp_path / "w.csv", tmp_path) == "w.csv"
    assert relative_csv(tmp_path / "w.csv", tmp_path / "other") == (tmp_path / "w.csv").as_posix()
