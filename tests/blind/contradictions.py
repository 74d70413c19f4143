"""What contradicts itself in a result: text, JSON, page and model of one diagnosis or one fit.

Each check reads two places that speak of one thing, and yields a sentence where they differ, or one
place that its own numbers refute. None knows what the rig hides.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from dearig.model.verdict import REJECTED_BELOW, TOLERANCE
from dearig.report.text.numbers import significant

__all__ = ["Said", "contradictions", "contradictions_in"]

#: A name should be as probable as this, unless the same page names what else it may be.
_NAMED = 0.5
#: A family that is as probable as this is a rival: an experiment should separate it.
_RIVAL = 0.2
#: Half an interval over its value, up to which a parameter is narrowly determined.
_NARROW = 0.05
_SAME = 2e-3  # relative: two numbers of three digits that are the same
_HIDDEN_TAGS = frozenset(("style", "script", "svg"))


@dataclass(frozen=True)
class Said:
    """One result in its forms: terminal ``text``, ``json``, text of the ``page``, ``model``."""

    text: str
    json: Mapping[str, Any]
    page: str
    model: Mapping[str, Any]

    @property
    def is_diagnosis(self) -> bool:
        """Whether it is a diagnosis."""
        return str(self.json["format"]).startswith("dearig-diagnosis")


class _Words(HTMLParser):
    """The text of a page, without figures."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []
        self._inside = 0

    def handle_starttag(self, tag: str, attrs: object) -> None:  # noqa: ARG002
        self._inside += tag in _HIDDEN_TAGS

    def handle_endtag(self, tag: str) -> None:
        self._inside -= tag in _HIDDEN_TAGS

    def handle_data(self, data: str) -> None:
        if not self._inside:
            self.parts.append(data)


def _words(page: str) -> str:
    reader = _Words()
    reader.feed(page)
    return _flat(" ".join(reader.parts))


def _flat(text: str) -> str:
    return " ".join(text.replace("\N{NO-BREAK SPACE}", " ").split())


def contradictions_in(folder: Path) -> list[str]:
    """Return what contradicts itself in the result in ``folder``: said.txt, .json, .html, model."""
    model = folder / "model.toml"
    return contradictions(
        Said(
            _flat((folder / "said.txt").read_text(encoding="utf-8")),
            json.loads((folder / "said.json").read_text(encoding="utf-8")),
            _words((folder / "said.html").read_text(encoding="utf-8")),
            tomllib.loads(model.read_text(encoding="utf-8")) if model.exists() else {},
        )
    )


def contradictions(said: Said) -> list[str]:
    """Return what contradicts itself in ``said``, a sentence each."""
    checks = [_labels, _parameters, _undetermined]
    checks += (
        [_errors, _steps, _verdict, _probabilities, _noise, _channels, _experiment, _counts, _model]
        if said.is_diagnosis
        else [_fit]
    )
    return [text for check in checks for text in check(said)]


# ---------------------------------------------------------------- of both


def _labels(said: Said) -> Iterator[str]:
    for place, text in (("text", said.text), ("page", said.page)):
        for sign in (
            "\N{HORIZONTAL ELLIPSIS}",
            " nan",
            " inf ",
            "None",
            "\N{REPLACEMENT CHARACTER}",
        ):
            if sign in text:
                at = text.index(sign)
                yield f"{place}: {sign.strip()!r} in {text[max(at - 30, 0) : at + 30]!r}"


def _free(json: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    steps = [p for step in json.get("steps", ()) for p in step["parameters"]]
    return [*json["parameters"], *json.get("sums", ()), *steps]


def _parameters(said: Said) -> Iterator[str]:
    for p in _free(said.json):
        low, high = p["ci95"]
        value, name = p["value"], p["name"]
        if value is None or low is None or high is None:
            continue
        inside = 1e-9 * max(abs(low), abs(high))
        if not low - inside <= value <= high + inside:
            yield f"{name} = {value:.6g} is outside of its interval {low:.6g} to {high:.6g}"
        elif (
            high > low
            and not p["at_bound"]
            and min(value - low, high - value) < 1e-4 * (high - low)
        ):
            yield f"{name} = {value:.6g} is at the end of its interval {low:.6g} to {high:.6g}"
        half = 0.5 * (high - low)
        if not p["determined"] and p.get("free", True) and 0.0 < half < _NARROW * abs(value):
            yield f"{name} is not determined, and its interval is {low:.6g} to {high:.6g}"
        if p["determined"] and low * high <= 0.0 < half and "sd" not in str(p.get("prior")):
            yield f"{name} is determined, and its interval {low:.6g} to {high:.6g} holds 0"


def _undetermined(said: Said) -> Iterator[str]:
    """The sentence, the table and the JSON have the same parameters that are not determined."""
    weak = [p for p in said.json["parameters"] if not p["determined"] and p.get("free", True)]
    sentence = "The data do not determine" in said.text
    every = "The data determine every parameter" in said.text
    if bool(weak) != sentence and "No intervals" not in said.text:
        yield f"{len(weak)} parameters are not determined; a sentence on them: {sentence}"
    if every and weak:
        yield f"every parameter is said to be determined, and {weak[0]['name']} is not"
    for total in said.json.get("sums", ()):
        parts = total["name"].split(" (+ ")[0].split(" + ")  # in brackets: in other fits
        known = {p["name"]: p["determined"] for p in said.json["parameters"]}
        values = {p["name"]: p["value"] for p in said.json["parameters"]}
        if not math.isclose(total["value"], sum(values[part] for part in parts), rel_tol=1e-9):
            yield f"the sum {total['name']} is {total['value']:.6g}, its parts {values}"
        if not total["determined"]:
            yield f"the sum {total['name']} is said to be determined, and is not"
        if all(known.get(part, False) for part in parts):
            yield f"the sum {total['name']} is shown, and all of its parts are determined"


# ---------------------------------------------------------------- of a diagnosis


_CHANGE = re.compile(
    r"On (?P<role>the validation recordings|the training recordings)[^.]*?the error "
    r"(?:(?P<verb>falls|rises) from (?P<first>\S+) to (?P<last>\S+)|(?:is|stays) (?P<only>\S+)) "
    r"\S+ RMS, (?:which is )?(?P<times>\S+) times the noise floor of (?P<floor>\S+) "
)


def _errors(said: Said) -> Iterator[str]:
    """Each error in a sentence is that of the JSON, and moves in the way that it is said to."""
    j = said.json
    found = {m["role"].split()[1]: m for m in _CHANGE.finditer(said.text)}
    for role, key in (("validation", "validation"), ("training", "train")):
        first, last = j["baseline"][key], j["final"][key]
        if last is None or last["rms_um"] is None:
            continue
        m = found.get(role)
        if m is None:
            yield f"no sentence has the error on the {role} recordings"
            continue
        told = (m["first"] or m["only"], m["last"] or m["only"])
        for what, text, value in (("before", told[0], first), ("after", told[1], last)):
            if text != significant(value["rms_um"]):
                yield f"{role} error {what}: {text} in the sentence, {value['rms_um']:.6g} in JSON"
        if m["verb"] and (m["verb"] == "falls") != (last["rms_um"] < first["rms_um"]):
            yield f"the {role} error {m['verb']}: {first['rms_um']:.4g} to {last['rms_um']:.4g}"
        ratio = last["rms_um"] / float(m["floor"])
        if not math.isclose(ratio, float(m["times"]), rel_tol=1e-2):
            yield f"{role}: {m['times']} times the noise, and {last['rms_um']:.4g}/{m['floor']}"
        if m.group(0).rstrip() not in said.page:
            yield f"the page has another sentence on the {role} error"


def _steps(said: Said) -> Iterator[str]:
    """A cross-validation error is not below the error of the fit; errors fall from step to step."""
    known = said.json["baseline"]["train"]["rms_um"]
    for step in said.json["steps"]:
        train, selection = step["train"]["rms_um"], step["selection"]["rms_um"]
        if train is None or selection is None:
            continue
        if selection < train * (1.0 - _SAME):
            yield f"{step['effect']}: cross-validation {selection:.4g}, training {train:.4g} um"
        if train > known * (1.0 + _SAME):
            yield f"{step['effect']}: training error grows from {known:.4g} to {train:.4g} um"
        known = train
    rows = re.search(r"Step by step .*?thesis model (\S+) (\S+) ", said.text)
    if rows and float(rows[2]) < float(rows[1]) * (1.0 - 5.0 * _SAME):
        yield f"thesis model: cross-validation {rows[2]}, training {rows[1]} um"


def _verdict(said: Said) -> Iterator[str]:
    j = said.json
    verdict, reasons = j["verdict"], j["verdict_reasons"]
    after = j["residual_after"]["signature"].values()
    if verdict in ("explained", "nothing_missing"):
        for s in after:
            if s["rms_over_noise"] > TOLERANCE:
                yield f"{verdict}, and a training recording keeps {s['rms_over_noise']:.3g} noises"
        if "reject" in said.text:
            yield f"{verdict}, and a model is called rejected"
    if verdict == "explained" and not j["steps"]:
        yield "explained by no effect"
    if verdict == "nothing_missing" and (j["steps"] or "lacks" in said.text):
        yield "nothing is missing, and an effect is named"
    before, final = j["baseline"]["validation"], j["final"]["validation"]
    if before and final and final["rms_um"] and verdict in ("explained", "partly_explained"):
        worse = final["rms_um"] > before["rms_um"] * (1.0 + _SAME)
        if worse and j["recommended"] == "final":
            yield f"a model that predicts worse, {final['rms_um']:.4g} um, is recommended"
        grows = final["rms_um"] > 0.98 * before["rms_um"]
        if (
            j["steps"]
            and grows
            and not reasons
            and final["rms_um"] > TOLERANCE * j["noise_floor_um"]
        ):
            yield f"{verdict}, and the validation error stays {final['rms_um']:.4g} um"
    if "excitation" in reasons and "reject the model" in said.text:
        yield "the recordings do not determine what is asked, and the data reject the model"
    if j["intervals_conditional"] != ("if right" in said.text) and j["steps"]:
        yield "intervals are conditional in one place and not in the other"
    text, page = said.text.split(". ")[0], said.page
    if text.split(";")[0].rstrip(".") not in page:
        yield f"the page has not the headline {text!r}"


def _probabilities(said: Said) -> Iterator[str]:
    j = said.json
    shares = {f["family"]: f["probability"] for f in j["families"]}
    missing = {f["family"]: f["probability_missing"] for f in j["families"]}
    if shares and not math.isclose(sum(shares.values()), 1.0, abs_tol=1e-6):
        yield f"the probabilities add up to {sum(shares.values()):.4g}"
    named = {s["family"] for s in j["steps"]}
    others = {f for s in j["steps"] for f in s["indistinguishable_from"]}
    if j["verdict"] in ("not_confirmed", "unexplained"):
        return  # no effect is named
    for s in j["steps"]:
        p = missing.get(s["family"])
        if p is not None and p < _NAMED and not s["indistinguishable_from"]:
            yield f"{s['effect']} is named, and its family has the probability {p:.2f}"
        if (told := _told_probability(said.text, s["family"])) and told != f"{p or 0.0:.2f}":
            yield f"{s['family']}: probability {told} in the text, {p} in JSON"
    for family, p in missing.items():
        if p is not None and p > _NAMED and family not in named | others | {"none", "unknown"}:
            yield f"{family} has the probability {p:.2f}, and is not named"
    if (
        j["verdict"] == "nothing_missing"
        and shares
        and max(shares, key=shares.__getitem__) != "none"
    ):
        yield "nothing is missing, and 'none' is not the most probable"


def _told_probability(text: str, family: str) -> str:
    label = "no known family" if family == "unknown" else family.replace("_", " ")
    found = re.search(rf"probability that {label} is among what is missing is (\d\.\d+)", text)
    return found[1] if found else ""


def _noise(said: Said) -> Iterator[str]:
    """What is called noise has no small probability of being noise, and the other way round."""
    after = said.json["residual_after"]
    for name, s in after["signature"].items():
        small = min(p for p in (s["ljung_box_p"], s["runs_p"], 1.0) if p is not None)
        if s["is_noise"] and small < REJECTED_BELOW:
            yield f"{name} is noise, with p = {small:.2g}"
        if (
            not s["is_noise"]
            and small > 0.05
            and s["rms_over_noise"] < 1.02
            and s["noise_p"] > 0.05
        ):
            yield f"{name} is not noise, and every test says that it is"
        only = any("only noise is left" in w or "noise, and slow changes" in w for w in s["words"])
        if only != s["is_noise"]:
            yield f"{name}: is_noise is {s['is_noise']}, and the words say: {s['words'][0]}"
    if after["is_noise"] != all(s["is_noise"] for s in after["signature"].values()):
        yield "residual_after.is_noise is not that of its recordings"
    sentence = re.search(r"With (?:it|them), only noise\W", said.text)
    if sentence and not after["is_noise"] and "does not look like it" not in said.text:
        yield "only noise is left, and the residual is none"


_DENIAL = re.compile(r"would change by (\S+) (\S+) RMS.*?\(noise (\S+) (\S+)")


def _channels(said: Said) -> Iterator[str]:
    j = said.json
    named = {s["effect"] for s in j["steps"]}
    for d in j["denied"]:
        if d["effect"] in named:
            yield f"{d['effect']} is named, and denied by the {d['channel']}"
        m = _DENIAL.search(d["text"])
        if m and m[2] == m[4] and float(m[1]) < 0.02 * float(m[3]):
            yield f"denied by a change of {m[1]} {m[2]} in a noise of {m[3]}: {d['effect']}"
        separates = (j["experiment"] or {}).get("rivals", ())
        if any(d["effect"] == r for r in separates) and "behind the point" not in said.text:
            yield f"{d['effect']} is to be separated, and denied by the {d['channel']}"
    for s in j["steps"]:
        for one in s["says"]:
            if one["verdict"] == "denies":
                yield f"{s['effect']} is named, and the {one['channel']} denies it"
    for c in j["channels"]:
        if c["used"] and c["after"] > 1.02 * c["before"]:
            yield f"{c['name']}: the residual grows from {c['before']:.4g} to {c['after']:.4g}"
        if not c["used"] and not c["reason"]:
            yield f"{c['name']} is not used, without a reason"
        if not c["used"] and c["name"] in {one["channel"] for s in j["steps"] for one in s["says"]}:
            yield f"{c['name']} is not used, and says something"


def _experiment(said: Said) -> Iterator[str]:
    j = said.json
    nothing = "nothing to separate" in said.text or "nothing to separate" in j["experiment_words"]
    rivals = any(s["indistinguishable_from"] for s in j["steps"])
    likely = [f for f in j["families"] if f["probability"] > _RIVAL and f["family"] != "none"]
    if nothing and (rivals or j["intervals_conditional"]):
        yield "nothing is to be separated, and the model is rejected or has a rival"
    if nothing and len(likely) > len(j["steps"]):
        yield f"nothing is to be separated from {likely[0]['family']} and {likely[1]['family']}"
    if j["experiment"] and not j["experiment"]["rivals"]:
        yield "an experiment separates nothing"


def _counts(said: Said) -> Iterator[str]:
    """Events and recordings are counted alike everywhere."""
    j = said.json
    told = sum(f"In {name} there is" in said.text for name in {e["record"] for e in j["events"]})
    if told != len({e["record"] for e in j["events"]}):
        yield f"events in {len(j['events'])} places, and {told} sentences on them"
    for key, label in (("train", "Training recordings"), ("validation", "Validation recordings")):
        for name in j["records"][key]:
            if name not in said.text or name not in said.page:
                yield f"{label}: {name} is missing in text or page"
    for rows in re.finditer(r"Candidates that explain less \((\d+)\)", said.page):
        if int(rows[1]) == 0:
            yield "a list of no candidates is folded"
    tried = "Each known effect was added" in said.page
    if tried != bool(j["rounds"]):
        yield f"{len(j['rounds'])} rounds of candidates, and the page says that all were tried"


def _model(said: Said) -> Iterator[str]:
    """The model that is written has the effects of the model that is recommended."""
    effects = {e["name"] for e in said.model.get("effect", ())}
    if not said.model:
        return
    named = {s["effect"] for s in said.json["steps"]}
    if said.json["recommended"] == "baseline" and effects:
        yield f"the baseline is recommended, and the model written has {', '.join(effects)}"
    if effects - named:
        yield f"the model written has {', '.join(effects - named)}, which is not named"


# ---------------------------------------------------------------- of a fit


def _fit(said: Said) -> Iterator[str]:
    j = said.json
    over, p = j["residual_over_noise"], j["misfit_p"]
    rejected = "The model is rejected" in said.text
    if j["rejected"] is not None and j["rejected"] != rejected and not j["validation"]:
        yield f"rejected is {j['rejected']}, and the text says {rejected}"
    if "almost only noise" in said.text and p is not None and p < REJECTED_BELOW and not rejected:
        yield f"almost only noise, with p = {p:.2g}"
    found = re.search(r"the error is (\S+) times that", said.text)
    if found and over is not None and found[1] != significant(over) and not j["validation"]:
        yield f"{found[1]} times the noise in the text, {over:.4g} in JSON"
    samples = sum(t["samples"] for t in j["train"])
    if f"{samples:,} sample" not in said.text:
        yield f"{samples:,} samples were fitted, and the text has another number"
    free = sum(q["free"] and not q["fixed"] for q in j["parameters"])
    counted = re.search(r"(\d+) free parameters?", said.text)
    if counted and int(counted[1]) != free:
        yield f"{counted[1]} free parameters in the text, {free} in JSON"
    if j["rejected"] and "if right" not in said.text:
        yield "the model is rejected, and its intervals are not marked"
