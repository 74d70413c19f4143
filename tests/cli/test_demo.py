"""The command ``dearig demo``, the main job of the program."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from dearig.analysis.diagnose import VALIDATION
from dearig.analysis.identify import identify_recordings
from dearig.analysis.outcomes import DiagnoseOutcome
from dearig.config.modelfile import load_model
from dearig.config.presets import VALIDATION_A, VALIDATION_B
from dearig.config.rigfile import RigFile
from dearig.drivers.settings import CardSettings
from tests.tools.command import SHORT_PRESETS, dearig, done, names
from tests.tools.diagnosis import diagnose_outcome


@pytest.fixture
def short_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    """A slow clock and one period of each lobe leave everything else as it is."""
    slow = RigFile(card=CardSettings(sample_rate_Hz=50.0))
    monkeypatch.setattr("dearig.cli.demo.RigFile", lambda: slow)
    monkeypatch.setattr("dearig.config.sequencefile.PRESETS", SHORT_PRESETS)


def test_demo_writes_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, short_demo: None
) -> None:
    """Of the two validations one recording each, and a diagnosis that another test looks for."""
    first = [next(iter(presets)) for presets in (VALIDATION_A, VALIDATION_B)]
    monkeypatch.setattr("dearig.cli.demo.VALIDATION_A", first[:1])
    monkeypatch.setattr("dearig.cli.demo.VALIDATION_B", first[1:])
    asked: list[tuple[object, object]] = []

    def diagnose(paths: object, *, validation: object, **_: object) -> DiagnoseOutcome:
        asked.append((paths, validation))
        return diagnose_outcome()

    monkeypatch.setattr("dearig.cli.demo.diagnose_recordings", diagnose)
    quick = partial(identify_recordings, intervals=False)
    monkeypatch.setattr("dearig.cli.demo.identify_recordings", quick)
    folder = tmp_path / "demo"
    found = done("demo", "--out", folder, "--json", "-").json
    assert found["format"] == "dearig-demo/1"
    recorded = {f"{p}.h5" for p in ("thesis", *first)}
    hidden = {f"hidden-{p}.h5" for p in ("thesis", *VALIDATION)}
    assert names(folder) == recorded | hidden | {
        "model.toml", "report.html", "overview.png", "improved.toml", "diagnosis.html",
    }  # fmt: skip
    assert asked == [
        ([folder / "hidden-thesis.h5"], [folder / f"hidden-{p}.h5" for p in VALIDATION])
    ]
    assert [r["table"] for r in found["validation"]["recordings"]] == ["A", "B"]
    check_demo_pages(found, folder)
    again = dearig("demo", "--out", folder)
    assert again.code == 2
    assert "is not empty; give another folder (--out), or use --force" in again.err


def check_demo_pages(found: dict, folder: Path) -> None:
    for row in found["validation"]["recordings"]:
        assert row["rms_um"] < 2.0 * found["validation"]["noise_floor_um"]
    assert Path(found["report"]).stat().st_size > 10_000
    assert load_model(folder / "improved.toml").name


@pytest.mark.deep
def test_demo_does_the_main_job(tmp_path: Path, short_demo: None) -> None:
    folder = tmp_path / "demo"
    found = done("demo", "--out", folder, "--json", "-").json
    assert [r["table"] for r in found["validation"]["recordings"]] == ["A"] * 5 + ["B"] * 5
    check_demo_pages(found, folder)
    # and of the rig that hides something
    diagnosis = found["diagnosis"]
    assert diagnosis["verdict"] == "explained"
    before = diagnosis["baseline"]["validation"]["rms_um"]
    after = diagnosis["final"]["validation"]["rms_um"]
    # in short recordings the displacement hardly shows the leak: the current does
    assert after < min(before, 1.15 * diagnosis["noise_floor_um"])
    assert [step["family"] for step in diagnosis["steps"]] == ["leakage"]
    current = {c["name"]: c for c in diagnosis["channels"]}["current"]
    assert current["after"] < 1.05 * current["noise"] < current["before"]
    assert load_model(folder / "improved.toml").model.effects
