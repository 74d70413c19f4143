"""Reports made again from what they hold, and their figures for print."""

from __future__ import annotations

import base64
import json
import re
import zlib
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import numpy as np
import pytest

from dearig.analysis.outcomes import DiagnoseOutcome, IdentifyOutcome, ValidateOutcome
from dearig.errors import InputError
from dearig.model.effects import EFFECTS
from dearig.recording.json_file import write_json
from dearig.recording.reading.origin import Origin
from dearig.report.again import read_result, write_again
from dearig.report.as_json import diagnosis_json, outcome_json, result_json
from dearig.report.made import Made
from dearig.report.pages.diagnosis import write_diagnosis_report
from dearig.report.pages.head import head_of
from dearig.report.pages.html import write_demo_report, write_identify_report
from dearig.report.pages.laws import law_view
from dearig.report.pages.seal import check_page
from dearig.report.stored import Outcome, _hints, restored, stored
from dearig.report.text import citation
from tests.deep import mostly_deep
from tests.tools.command import dearig, done, refused
from tests.tools.diagnosis import diagnose_outcome, film_diagnosis
from tests.tools.reports import actuator_comparison, identify_outcome, validate_outcome

MADE = Made("dearig 1.2.3", "2026-01-02 03:04:05+01:00", "dearig identify 'a b.h5'")
SIMULATED = Origin("train.h5", simulated=True, source="rig sim:8", seed=3)


def without_heads(page: Path) -> str:
    """The text of a page without what made it, its data and its checksum."""
    text = page.read_text(encoding="utf-8")
    text, _, end = text.partition('<h2 id="made">')
    rows = re.sub(r"<div><dt>(Report made|Made again)</dt>.*?</div>\n", "", end)
    rows = re.sub(r'href="data:application[^"]*"', "", rows)
    return text + rows.partition("<!-- dearig report")[0]


def plain(outcome: Outcome) -> dict[str, object]:
    """All numbers of an outcome, without the outcome itself."""
    return {k: v for k, v in result_json(outcome).items() if k != "report"}


@pytest.mark.parametrize("kind", mostly_deep(["fit", "diagnosis", "film"], ["diagnosis"]))
def test_a_page_made_again_is_the_page(tmp_path: Path, kind: str) -> None:
    first, again, twice = (tmp_path / name for name in ("1.html", "2.html", "3.html"))
    if kind == "fit":
        write_demo_report(identify_outcome(), validate_outcome(), first)
    else:
        made = film_diagnosis() if kind == "film" else diagnose_outcome()
        write_diagnosis_report(made, first)
    write_again(first, again)
    assert without_heads(again) == without_heads(first)
    assert "Made again" not in first.read_text(encoding="utf-8")
    assert "Made again" in again.read_text(encoding="utf-8")
    check_page(again.read_text(encoding="utf-8"), "again")
    write_again(again, twice)  # what made the result stays
    assert read_result(twice).made == read_result(first).made
    assert without_heads(twice) == without_heads(first)


@pytest.mark.parametrize(
    "outcome",
    [identify_outcome(), validate_outcome(), diagnose_outcome(), film_diagnosis()],
    ids=["identification", "validation", "diagnosis", "film"],
)
def test_a_json_file_holds_every_number_of_its_result(tmp_path: Path, outcome: Outcome) -> None:
    path = tmp_path / "result.json"
    write_json(result_json(outcome), path)
    (back,) = read_result(path).outcomes
    assert type(back) is type(outcome)
    assert plain(back) == plain(outcome)


def test_numbers_alone_are_not_the_whole_result() -> None:
    """The window and a study's file keep the outcome in another way, and do not pay for two."""
    assert "report" not in outcome_json(identify_outcome())
    assert "report" not in outcome_json(validate_outcome())
    assert "report" not in diagnosis_json(diagnose_outcome())


def test_arrays_and_odd_numbers_come_back_bit_by_bit() -> None:
    outcome = identify_outcome()
    odd = outcome.train[0].measured.copy()
    odd[[3, 4, 5]] = np.nan, np.inf, -0.0
    train = (replace(outcome.train[0], measured=odd, noise=None),)
    model = replace(outcome.model, history={"a": [1, {"b": float("inf")}], "when": "now"})
    held = stored((replace(outcome, train=train, model=model),), MADE)
    found = restored(held, "x")
    (back,) = found.outcomes
    assert isinstance(back, IdentifyOutcome)
    assert back.train[0].measured.tobytes() == odd.tobytes()
    assert back.train[0].noise is None
    assert back.model.history == model.history
    assert back.model.model == model.model
    assert back.fit.estimates == outcome.fit.estimates  # some intervals end at infinity
    assert found.made == MADE


def test_every_type_in_an_outcome_is_known() -> None:
    """A field of a new type is added with the module that has it."""
    seen: set[object] = set()

    def look(hint: object) -> None:
        if hint in seen:
            return
        seen.add(hint)
        # a tuple with names comes back as a list
        assert not (isinstance(hint, type) and hasattr(hint, "_fields")), hint
        for part in get_args(hint):
            look(part)
        if is_dataclass(hint):
            for field in fields(hint):
                look(_hints(hint)[field.name])

    for kind in (IdentifyOutcome, ValidateOutcome, DiagnoseOutcome):
        look(kind)
    assert sum(map(is_dataclass, seen)) > 30


# ---------------------------------------------------------------- what no program wrote


def document(held: str) -> tuple[dict[str, object], bytes]:
    head, _, rest = zlib.decompress(base64.b64decode(held)).partition(b"\n")
    return json.loads(head), rest


def packed(head: object, rest: bytes) -> str:
    return base64.b64encode(zlib.compress(json.dumps(head).encode() + b"\n" + rest)).decode()


def changed(path: list[object], value: object) -> str:
    """A stored identification with one value replaced."""
    head, rest = document(stored((identify_outcome(),), MADE))
    at: object = head
    for name in path[:-1]:
        at = at[name]  # type: ignore[index]
    at[path[-1]] = value  # type: ignore[index]
    return packed(head, rest)


_VALUE = ["outcomes", 0, "value"]


@pytest.mark.parametrize(
    ("held", "words"),
    [
        ("", "incomplete"),
        ("%%%%", "holds no result"),
        (base64.b64encode(b"no zlib").decode(), "holds no result"),
        (base64.b64encode(zlib.compress(b"{}")[:-3]).decode(), "incomplete"),
        (packed([], b""), "holds no result"),
        (changed(["format"], "dearig-report/9"), "reads dearig-report/1"),
        (changed(["outcomes"], []), "no result"),
        (changed(["outcomes", 0, "kind"], "recipe"), "recipe"),
        (changed([*_VALUE, "seconds"], "long"), "str where"),
        (changed([*_VALUE, "seconds"], True), "bool where"),
        (changed([*_VALUE, "fit", "covariance"], {"array": 10**6}), "index"),
        (changed([*_VALUE, ""], "ValidateOutcome"), "no IdentifyOutcome"),
        (changed([*_VALUE, "surprise"], 1), "has no surprise"),
        (changed([*_VALUE, "model", "model", ""], "Popen"), "none of"),
        (changed([*_VALUE, "model", "model", "film", "length"], None), "NoneType where"),
        (changed(["arrays", 0], ["|O8", 4]), "another kind"),
        (changed(["arrays", 0], ["<f8", -4]), "another kind"),
        (changed(["arrays", 0], ["<f8", 10**9]), "holds no result"),
    ],
)
def test_what_no_version_wrote_is_refused_in_a_sentence(held: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        restored(held, "r.json")


def test_files_without_a_result_are_refused(tmp_path: Path) -> None:
    write_identify_report(identify_outcome(), tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    for name, content, words in (
        ("a.html", text.replace("Thesis excitation", "Other excitation"), "was changed"),
        ("b.json", "{}", "holds no result"),
        ("c.json", "[1]", "holds no result"),
        ("d.json", '{"report": 3}', "holds no result"),
        ("e.json", "a poem", "is neither a report nor"),
    ):
        (tmp_path / name).write_text(content, encoding="utf-8", newline="\n")
        with pytest.raises(InputError, match=words):
            read_result(tmp_path / name)


def test_a_value_that_this_version_cannot_show_is_told(tmp_path: Path) -> None:
    spring = [*_VALUE, "fit", "model", "network", "equilibrium", "kind"]
    write_json({"report": changed(spring, "a spring of later")}, tmp_path / "r.json")
    with pytest.raises(InputError, match="version that wrote it can"):
        write_again(tmp_path / "r.json", tmp_path / "r.html")


# ---------------------------------------------------------------- figures


@pytest.mark.deep
def test_figures_for_print(tmp_path: Path) -> None:
    train = actuator_comparison(origin=SIMULATED)
    report = tmp_path / "report.html"
    write_identify_report(identify_outcome(train=(train,)), report)
    done("figures", report, "--to", "pdf", "--json", tmp_path / "f.json")
    folder = tmp_path / "report-figures"
    told = json.loads((tmp_path / "f.json").read_text(encoding="utf-8"))
    numbers = [f["number"] for f in told["figures"]]
    assert numbers == list(range(1, len(numbers) + 1))
    captions = (folder / "captions.txt").read_text(encoding="utf-8")
    for figure in told["figures"]:
        file = Path(figure["file"])
        raw = file.read_bytes()
        assert b"/FontFile2" in raw
        assert b"/CIDFontType2" in raw
        assert b"/Type3" not in raw  # journals refuse it
        box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", raw)
        assert box is not None
        assert float(box[1]) == pytest.approx(89.0 / 25.4 * 72.0, abs=0.1)
        assert f"{file.name}: Figure {figure['number']}. {figure['caption']}" in captions
        assert "Simulated data: no measured data (rig sim:8, noise seed 3)." in figure["caption"]


@pytest.mark.deep
def test_figures_over_two_columns_have_text_that_is_text(tmp_path: Path) -> None:
    write_json(result_json(identify_outcome()), tmp_path / "r.json")
    out = tmp_path / "out"
    done("figures", tmp_path / "r.json", "--to", "svg", "--columns", "2", "--out", out)
    svg = "{http://www.w3.org/2000/svg}"
    for path in out.glob("*.svg"):
        root = ElementTree.parse(path).getroot()  # noqa: S314  # the command wrote it
        assert float(root.get("width", "").removesuffix("pt")) == pytest.approx(
            183.0 / 25.4 * 72.0, abs=0.1
        )
        words = ["".join(text.itertext()) for text in root.iter(f"{svg}text")]
        assert any("(" in word for word in words)  # a unit on an axis
    refused(dearig("figures", tmp_path / "r.json", "--to", "svg", "--out", out), "is not empty")
    done("figures", tmp_path / "r.json", "--to", "svg", "--out", out, "--force")


def test_the_command_makes_a_report_again(tmp_path: Path) -> None:
    write_json(result_json(identify_outcome()), tmp_path / "r.json")
    done("report", tmp_path / "r.json", "--out", tmp_path / "r.html")
    check_page((tmp_path / "r.html").read_text(encoding="utf-8"), "r.html")
    refused(dearig("report", tmp_path / "r.json", "--out", tmp_path / "r.html"), "exists")
    refused(dearig("report", tmp_path / "r.json", "--out", tmp_path / "r.json", "--force"), "input")


# ---------------------------------------------------------------- heads


def test_the_answer_stands_before_who_and_when(tmp_path: Path) -> None:
    write_diagnosis_report(diagnose_outcome(), tmp_path / "d.html")
    write_identify_report(
        identify_outcome(train=(actuator_comparison(origin=SIMULATED),)), tmp_path / "f.html"
    )
    for name, answer in (("d", "Residual explained"), ("f", "was fitted to")):
        text = (tmp_path / f"{name}.html").read_text(encoding="utf-8")
        body = text[text.index("<body>") :]
        places = [body.index(w) for w in (answer, "<table", "<figure", "<nav", "<dt>Command</dt>")]
        assert places[0] == min(places)
        assert max(places[1:3]) < places[3] < places[4]
    assert body.index("SIMULATED") < body.index(answer)


def test_every_report_says_how_to_cite_the_program() -> None:
    (software, thesis) = dict(head_of([SIMULATED]).rows)["Cite as"]
    known = (Path(__file__).parents[2] / "CITATION.cff").read_text(encoding="utf-8")
    for text in (citation.SOFTWARE_TITLE, citation.SOFTWARE_AUTHORS):
        assert f'"{text}"' in known
        assert text in software
    assert f"date-released: {citation.SOFTWARE_YEAR}-" in known
    assert f"({citation.SOFTWARE_YEAR})" in software
    for text in ("Free-Energy Based Modeling of Planar Dielectric Elastomer Actuators", "Fan"):
        assert text in known
        assert text in thesis


def test_equations_of_every_effect_may_be_printed() -> None:
    drawn = 0
    for effect in EFFECTS.values():
        if (view := law_view(effect)) is not None:
            drawn += 1
            page = check_elements("".join((*view.equations, *(s for s, _ in view.symbols))))
            assert page
    assert drawn > 40


def check_elements(markup: str) -> bool:
    from dearig.report.pages.seal import _HEAD, sealed

    check_page(sealed(f"{_HEAD}<title>t</title></head><body>{markup}</body></html>\n"), "page")
    return True
