"""Names, notes and texts of others in every kind of page, as a browser reads them."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.outcomes import Evaluation
from dearig.analysis.tracking import TrackedRun, TrackOutcome
from dearig.api.display import card, drawing, facts, table_html, write_page
from dearig.batch.campaign import CampaignOutcome
from dearig.batch.queue import Queue, RunState
from dearig.config.sequencefile import load_sequence
from dearig.config.targetfile import LoadedTarget
from dearig.drivers.gate import Margin
from dearig.model.control import Inversion
from dearig.recording.reading.origin import Origin
from dearig.report.figures.recordings import comparison_figure
from dearig.report.pages.campaign import write_campaign_report
from dearig.report.pages.diagnosis import write_diagnosis_report
from dearig.report.pages.html import write_identify_report
from dearig.report.pages.track import write_track_report
from dearig.report.text.tables import Row, Table
from tests.tools.browser import CHROMIUM, Browser
from tests.tools.diagnosis import diagnose_outcome
from tests.tools.reports import (
    actuator_comparison,
    identify_outcome,
)

EVIL = (
    "=\"'></title></style></p></td></svg></script><script>window.ran = 1</script>"
    '<img src=x onerror="window.ran = 1"><svg onload="window.ran = 1"></svg>'
    '<a href="javascript:window.ran = 1">x</a><h2 id="evil">x</h2><base href="//x.example">'
    '<iframe srcdoc="<script>parent.ran = 1</script>"></iframe> -->]]> <!-- contents --> '
    "$\\frac{$ {{ 7 * 7 }} \u202egnp.exe"
)
#: What a page of this program has; everything else would be from a name.
FOREIGN = """
(() => {
  const foreign = "script,img,iframe,object,embed,base,link,form,input,button,video,audio," +
    "foreignObject,math:not(.law math),template,#evil,meta[http-equiv=refresh]";
  const odd = [...document.querySelectorAll(foreign)].map(e => e.outerHTML);
  for (const e of document.querySelectorAll("*"))
    for (const a of e.attributes) {
      if (a.name.startsWith("on")) odd.push(a.name);
      const away = !/^(#|data:text\\/csv;|data:application\\/json,)/.test(a.value);
      if (/^(xlink:)?href$/.test(a.name) && away) odd.push(a.value);
    }
  const bodies = document.querySelectorAll("main").length;
  return JSON.stringify({odd, ran: window.ran ?? 0, bodies,
    shown: document.body.textContent.includes("<script>window.ran = 1"),
    width: document.documentElement.scrollWidth});
})()
"""


def hostile(value: object, names: tuple[str, ...]) -> object:
    """Return ``value`` with ``EVIL`` in its text fields ``names``, at any depth."""
    if isinstance(value, tuple):
        return tuple(hostile(v, names) for v in value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    changes = {}
    for field in fields(value):
        found = getattr(value, field.name)
        if field.name in names and isinstance(found, str):
            changes[field.name] = EVIL
        elif isinstance(found, tuple) or is_dataclass(found):
            changes[field.name] = hostile(found, names)
    return replace(value, **changes)


def pages(folder: Path) -> list[Path]:
    """Write a report of every kind, in which all text that others give is ``EVIL``."""
    origin = Origin(EVIL, EVIL, True, EVIL, 1, EVIL, EVIL, EVIL, EVIL)
    given = {"row": EVIL, "warnings": (EVIL,), "origin": origin}
    said = {
        "title": EVIL,
        "model_path": EVIL,
        "quality": (EVIL,),
        "few_data": EVIL,
        "assumed": EVIL,
    }
    train = actuator_comparison(EVIL, rate=10.0, **given)
    fitted = identify_outcome(train=(train,), **said)
    made = [
        write_identify_report(fitted, folder / "identify.html"),
    ]
    diagnosed = diagnose_outcome(**said, performed=(EVIL,), rig=EVIL, experiment_text=EVIL)
    finding = hostile(
        replace(diagnosed.finding, missing_before=(), missing_after=()),
        ("note", "reason", "record", "evidence"),
    )
    stands = tuple(
        Evaluation(stand.effects, (replace(stand.train[0], name=EVIL, origin=origin),), ())
        for stand in diagnosed.stands
    )
    experiment = hostile(diagnosed.experiment, ("name", "sequence"))
    diagnosed = replace(diagnosed, finding=finding, stands=stands, experiment=experiment)
    made.append(write_diagnosis_report(diagnosed, folder / "diagnosis.html"))
    queue = Queue(name=EVIL, rig=EVIL, halted=EVIL, started=EVIL)
    entry = {"name": EVIL, "state": "done", "reason": EVIL, "settings": {EVIL: EVIL}}
    queue.runs[EVIL] = RunState(**entry, recording=EVIL, numbers={EVIL: 1.0})
    queue.order.append(EVIL)
    outcome = CampaignOutcome(EVIL, folder / "none", queue, "complete", EVIL)
    made.append(write_campaign_report(outcome, folder / "campaign.html"))
    made.append(write_track_report(_tracked(folder), folder / "track.html"))
    table = table_html(Table(EVIL, ((EVIL, EVIL),), (Row((EVIL,)),), EVIL))
    figure = drawing(comparison_figure(fitted.train[0]), EVIL)
    body = card(EVIL, facts([(EVIL, EVIL)]), table, figure, sentences=[EVIL])
    made.append(write_page(folder / "card.html", EVIL, "Recording", body, [origin]))
    return made


def _tracked(folder: Path) -> TrackOutcome:
    """Return one run of a target."""
    time = np.linspace(0.0, 2.0, 201)
    path = 1e-3 * np.sin(np.pi * time / 2.0) ** 2
    voltage, reachable = 6e3 * np.sqrt(path / 1e-3), np.ones(time.size, dtype=bool)
    inversion = Inversion(time, 100.0, voltage, path, path, path, reachable, (), 1)
    margin = Margin(EVIL, 1.0, 2.0, EVIL)
    run = TrackedRun(
        "model", 0, 1e-6, 3e-6, time.size, folder / "none.h5", (margin,), time, path,
        path, voltage, 1e-6, notes=(EVIL,),
    )  # fmt: skip
    target = LoadedTarget(EVIL, "", load_sequence("thesis"))
    return TrackOutcome(
        target, replace(identify_outcome().model, name=EVIL), EVIL,
        inversion, 1e-6, (run,), 1e-6, "stopped", EVIL, (EVIL,),
    )  # fmt: skip


@pytest.mark.skipif(not CHROMIUM or sys.platform == "win32", reason="needs Chromium on Linux")
def test_no_text_of_others_becomes_an_element_or_runs(tmp_path):
    made = pages(tmp_path)
    with Browser(tmp_path / "profile") as browser:
        for page in made:
            # without its policy, which alone would stop every script
            text = page.read_text("utf-8")
            bare = re.sub(r"<meta http-equiv=[^>]*>", "", text, count=1)
            assert len(bare) < len(text)
            page.write_text(bare, encoding="utf-8")
            browser.open(page.as_uri())
            browser.await_true("document.readyState == 'complete'")
            found = json.loads(browser.evaluate(FOREIGN))
            assert found == {"odd": [], "ran": 0, "bodies": 1, "shown": True, "width": 390}, page
