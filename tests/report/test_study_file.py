"""A study is saved with all that is shown of it, and can be shown again."""

from __future__ import annotations

import json
import math
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.study import Residual, Study, StudyRequest, Trace
from dearig.errors import InputError
from dearig.report.study_file import FORMAT, open_study, save_study, studies_in
from dearig.report.study_view import view_of
from tests.tools.diagnosis import (
    diagnose_outcome,
    electric_outcome,
    film_diagnosis,
    finding,
    nothing_missing,
)
from tests.tools.reports import identify_outcome

TASK = StudyRequest(diagnose=True, train=(Path("train.h5"),), validation=())


def residuals() -> tuple[Residual, ...]:
    found = finding()
    before = found.before[0]
    return (
        Residual(
            before.record, "actuator", before.noise, None,
            (Trace("", before.time, before.residual),), (Trace("", before.time, before.residual),),
            (before.dependences,), found.missing_before, before.words,
        ),
    )  # fmt: skip


def made(folder: Path, outcome) -> Study:
    folder.mkdir()
    return Study(TASK, outcome, residuals(), folder / "model.toml", folder / "report.html")


def same(a: object, b: object) -> bool:
    """Whether two values are equal, arrays too, and NaN to NaN."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and np.array_equal(a, b, equal_nan=True)
    if is_dataclass(a):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and math.isnan(a):
        return isinstance(b, float) and math.isnan(b)
    return a == b


@pytest.mark.parametrize(
    "outcome", [diagnose_outcome(), nothing_missing(), film_diagnosis(), identify_outcome()]
)
def test_what_is_reopened_is_what_was_shown(tmp_path, outcome):
    view = view_of(made(tmp_path / "study-1", outcome))
    path = save_study(view)
    told = json.loads(path.read_text(encoding="utf-8"))
    assert told["format"] == FORMAT
    again = open_study(path.parent)
    for field in fields(view):
        assert field.name in ("pairs", "numbers") or same(
            getattr(view, field.name), getattr(again, field.name)
        ), field.name
    assert again.numbers == told["numbers"]
    for pair, copy in zip(view.pairs, again.pairs, strict=True):
        for one, other in zip(pair, copy, strict=True):
            assert (one is None) == (other is None)
            if one is not None:
                assert one.name == other.name
                assert all(
                    same(getattr(one, n), getattr(other, n))
                    for n in ("time", "drive", "measured", "model", "errors", "noise", "role")
                )
    assert again.model == path.parent / "model.toml"


def test_studies_are_listed_and_a_damaged_one_says_so(tmp_path):
    assert studies_in(tmp_path) == ()
    save_study(view_of(made(tmp_path / "study-1", diagnose_outcome())))
    (tmp_path / "study-2").mkdir()
    (tmp_path / "study-2" / "study.json").write_text("{", encoding="utf-8")
    (tmp_path / "a").mkdir()  # a folder that is not a study
    listed = {folder.name: words for folder, words, _ in studies_in(tmp_path)}
    assert listed.keys() == {"study-1", "study-2"}
    assert "these data cannot tell" in listed["study-1"]
    assert "is not JSON" in listed["study-2"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("[]", "is not of the format dearig-study/1"),
        ('{"format": "dearig-study/9"}', "is not of the format dearig-study/1"),
        ('{"format": "dearig-study/1"}', "are damaged"),
        ("[" * 100_000, "is not JSON"),
    ],
)
def test_other_files_are_refused_with_a_sentence(tmp_path, words, said):
    path = save_study(view_of(made(tmp_path / "study-1", diagnose_outcome())))
    path.write_text(words, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        open_study(path.parent)


def test_missing_and_foreign_curves_are_refused(tmp_path):
    path = save_study(view_of(made(tmp_path / "study-1", diagnose_outcome())))
    curves = path.parent / "curves.npz"
    curves.write_bytes(b"not a zip")
    with pytest.raises(InputError, match="are damaged"):
        open_study(path.parent)
    # nothing in such a file is ever executed
    np.savez(curves, a0=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputError, match="are damaged"):
        open_study(path.parent)
    curves.unlink()
    with pytest.raises(InputError, match="cannot be read"):
        open_study(path.parent)


def test_a_study_of_recordings_with_electrical_channels_is_saved(tmp_path):
    view = view_of(made(tmp_path / "study-1", electric_outcome()))
    again = open_study(save_study(view).parent)
    assert [len(one.curves) for one, _ in again.pairs] == [2, 2, 2]
    for pair, copy in zip(view.pairs, again.pairs, strict=True):
        assert all(same(one.curves, other.curves) for one, other in zip(pair, copy, strict=True))
