"""Numbers of every run of a campaign: its peak, and the air of its room."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dearig.batch.after import compute
from dearig.batch.watching import seen
from dearig.config.campaignfile import parse_campaign
from dearig.config.rigfile import RigFile
from dearig.recording import RunMetadata
from dearig.recording.writing.save import save_recording
from dearig.report.pages.campaign import campaign_table, numbers_figure
from tests.tools.command import LOBE, write
from tests.tools.played import PLAN, Bench


def test_peak_and_room_of_a_run_are_numbers_without_a_plan_for_them(tmp_path: Path) -> None:
    write(tmp_path / "lobe.toml", LOBE)
    plan = parse_campaign(PLAN, "plan.toml", tmp_path)
    time = np.arange(400) * 5e-3
    values = {
        "time": time,
        "voltage_command": 3e3 * np.sin(np.pi * time / 2.0),
        "displacement": -0.4e-3 * np.sin(np.pi * time / 2.0) ** 2,
    }
    for warm in (False, True):
        path = tmp_path / f"run-{warm}.h5"
        room = {"temperature": np.linspace(22.0, 24.0, 400)} if warm else {}
        save_recording(path, "actuator", {**values, **room}, RunMetadata())
        found = compute(plan, path, tmp_path, "", RigFile())
        assert abs(found.numbers["peak_displacement_mm"] + 0.4) < 1e-9
        assert found.numbers.get("temperature_degC") == (
            None if not warm else float(np.mean(room["temperature"]))
        )
        assert found.problems == []


def test_a_recording_that_cannot_be_read_is_a_problem_of_its_run(tmp_path: Path) -> None:
    write(tmp_path / "lobe.toml", LOBE)
    plan = parse_campaign(PLAN, "plan.toml", tmp_path)
    broken = write(tmp_path / "broken.h5", "no recording")
    found = compute(plan, broken, tmp_path, "", RigFile())
    assert found.numbers == {}
    assert found.problems[0].startswith("peak and room: ")


def test_a_report_shows_peak_and_room_beside_the_fit(bench: Bench) -> None:
    bench.play()
    outcome = seen(bench.out)
    room = {
        "peak_displacement_mm": 0.4,
        "temperature_degC": 23.1,
        "relative_humidity_percent": 41.0,
    }
    for run in outcome.queue.listed:
        run.numbers = {"fit_nrmse_pct": 0.1, "fit_rms_um": 1.0, "mu_0_kPa": 45.7, **room}
    head = [name for name, _ in campaign_table(outcome).head]
    assert head[-6:] == ["mu_0_kPa", "fit_rms_um", *room, "fit_nrmse_pct"]
    labels = [ax.get_ylabel() for ax in numbers_figure(outcome.queue, list(room)).axes]
    assert labels == list(room)
