"""Whose gain and limits apply, and what differs from them, is said before a card is armed."""

from __future__ import annotations

from io import StringIO

from rich.console import Console

from dearig.acquisition.rig_source import film_differences, in_force, source_of
from dearig.analysis.tracking import misfits_of
from dearig.cli.rig_settings import announce_rig
from dearig.config.rigfile import RigFile
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator


def test_a_model_of_another_film_does_not_change_whose_gain_applies() -> None:
    theirs = RigFile()
    ours = RigFile.model_validate(
        {"amplifier": {"gain_V_per_V": 900.0}, "film": {"width_mm": 60.0}}
    )
    other = film_differences(theirs.as_film(), theirs.as_load(), ours)
    assert other == ("width: 0.072 in the model, 0.06 in the rig file (SI units)",)
    assert film_differences(ours.as_film(), ours.as_load(), ours) == ()
    said = StringIO()
    announce_rig(Console(file=said, width=1000), "daqmx:Dev1", ours, source_of("lab.toml"), other)
    assert "those of rig file lab.toml: amplifier 900 V/V" in said.getvalue()
    assert "width: 0.072 in the model" in said.getvalue()
    assert "hardware watchdog: not wired" in said.getvalue()


def test_without_a_rig_file_the_rig_of_the_thesis_is_named() -> None:
    said = in_force(RigFile(), source_of(None))
    assert said.startswith("scaling and limits are those of the thesis's rig, as no rig file was")


def test_the_page_and_the_results_say_it_too() -> None:
    ours = RigFile.model_validate({"film": {"width_mm": 60.0}})
    model = Actuator(RigFile().as_film(), RigFile().as_load(), TABLE_3)
    (said,) = misfits_of(model, ours)
    assert said.startswith("the model is of another film than the rig file's")
    assert list(misfits_of(model, RigFile())) == []
