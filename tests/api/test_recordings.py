"""Runs and recordings as a notebook has them: no file, no clock, no console."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest

import dearig
from dearig.config.modelfile import save_model
from dearig.model.film.material import TABLE_3, Film, Load
from dearig.model.simulation.actuator import Actuator

from .conftest import SLOW_RIG

LOBE = dearig.Sequence("lobe", lead_in_s=0.4, tail_s=0.1).half_sine(
    amplitude_kV=3.0, frequency_Hz=1.0
)


def test_a_run_without_a_path_is_kept_as_long_as_its_value() -> None:
    run = dearig.record(LOBE, rig_file=SLOW_RIG)
    path = run.path
    assert path.is_file()
    del run
    gc.collect()
    assert not path.parent.exists()


def test_a_run_is_saved_where_it_is_wanted(tmp_path: Path, run: dearig.Recording) -> None:
    path = run.save(tmp_path / "kept.h5")
    again = dearig.open(path)
    np.testing.assert_array_equal(again.displacement, run.displacement)
    assert (again.film_id, again.notes, again.samples) == ("F7", "a test", run.samples)
    with pytest.raises(dearig.InputError, match="exists already"):
        run.save(path)
    assert dearig.record(LOBE, path=path, overwrite=True).samples == 1501
    with pytest.raises(dearig.InputError, match="exists already"):
        dearig.record(LOBE, path=path)


def test_a_run_says_how_near_it_came_to_the_limits(run: dearig.Recording) -> None:
    voltage = next(m for m in run.margins if m.quantity == "voltage")
    assert voltage.reached == pytest.approx(8.0, rel=1e-3)
    assert voltage.reached < voltage.allowed
    assert dearig.open(run.path).margins == ()


def test_a_run_prints_nothing_and_tells_its_progress(capfd: pytest.CaptureFixture[str]) -> None:
    told: list[tuple[str, float]] = []
    dearig.record(LOBE, rig_file=SLOW_RIG, progress=lambda *step: told.append(step))
    # where the disk is slow the rows that are still written are told as well
    assert [step for step in told if step[0] != "writing"][-1] == ("recording", 1.0)
    assert capfd.readouterr() == ("", "")


def test_film_and_load_of_a_run_are_those_of_its_model(tmp_path: Path) -> None:
    film, load = Film(0.05, 0.06, 1e-3), Load(0.05)
    save_model(tmp_path / "m.toml", "small", Actuator(film, load, TABLE_3), {})
    for model in (tmp_path / "m.toml", dearig.Model.open(tmp_path / "m.toml")):
        run = dearig.record(LOBE, rig_file=SLOW_RIG, model=model, overlay=model)
        assert run.film == film
        assert run.load is not None
        assert run.load.mass == pytest.approx(0.05)
        # the overlay is the simulated film itself: only the laser's noise is left
        assert np.std(run.displacement - run.displacement_model) < 1.5e-6


def test_what_the_rig_does_not_allow_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    high = dearig.Sequence("high").ramp(to_kV=12.0, duration_s=1.0).ramp(to_kV=0.0, duration_s=1.0)
    with pytest.raises(dearig.InputError, match=r"sequence 'high' is refused: .*voltage"):
        dearig.record(high, path=tmp_path / "run.h5")
    assert not list(tmp_path.iterdir())
    with pytest.raises(dearig.InputError, match="mass_kg is not a key"):
        dearig.record(LOBE, rig_file={"load": {"mass_kg": 0.2}})
    with pytest.raises(dearig.InputError, match="rig 'simulated' is not known"):
        dearig.record(LOBE, rig="simulated")


def test_tables_of_a_rig_file_take_numbers_of_numpy_and_nothing_else() -> None:
    limits = {"voltage_max_kV": np.float32(0.5), "time_at_voltage_max_s": np.int64(60)}
    with pytest.raises(dearig.InputError, match=r"0\.5 kV is allowed"):
        dearig.record(LOBE, rig_file={"limits": limits})
    for wrong in (None, 2j, np.array([0.5])):
        with pytest.raises(dearig.InputError, match="a value that a rig file cannot have"):
            dearig.record(LOBE, rig_file={"limits": {"voltage_max_kV": wrong}})
    with pytest.raises(dearig.InputError, match="a value that a rig file cannot have"):
        dearig.record(LOBE, rig_file={"limits": None})  # type: ignore[dict-item]


def test_a_run_that_ends_early_keeps_its_temporary_file() -> None:
    with pytest.raises(dearig.SafetyStop) as raised:
        dearig.record(LOBE, rig="sim:3", rig_file=SLOW_RIG, faults=["arc@0.8"])
    path = Path(str(raised.value).partition("what was recorded is in ")[2].partition(" (")[0])
    assert dearig.open(path).samples > 100
    path.unlink()
    path.parent.rmdir()


def test_a_recording_shows_itself(run: dearig.Recording, tmp_path: Path) -> None:
    assert repr(run).startswith("<Recording 'short-thesis': actuator, ")
    html = run._repr_html_()
    for part in ("F7, 75 x 72 x 1 mm", "200 g", "noise floor", "<svg", "finished"):
        assert part in html
    page = run.to_html(tmp_path / "run.html").read_text(encoding="utf-8")
    assert html in page
    drive, response = (ax.lines[0].get_ydata() for ax in run.plot().axes)
    assert drive.max() == pytest.approx(8.0, rel=1e-3)  # kV
    assert response.max() == pytest.approx(1e3 * run.displacement.max(), rel=1e-6)  # mm


def test_names_from_outside_are_no_markup(tmp_path: Path) -> None:
    run = dearig.record(LOBE, rig_file=SLOW_RIG, film="<script>alert(1)</script>")
    assert "<script" not in run._repr_html_()


def test_a_figure_is_a_picture_in_a_notebook(run: dearig.Recording) -> None:
    picture, size = run.plot()._repr_png_()
    assert picture.startswith(b"\x89PNG")
    assert size["width"] > size["height"] > 100


def test_what_is_no_recording_is_said_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("no HDF5", encoding="utf-8")
    with pytest.raises(dearig.InputError, match="is not an HDF5 file"):
        dearig.open(tmp_path / "text.h5")
    with pytest.raises(dearig.InputError, match="is not there"):
        dearig.open(tmp_path / "gone.h5")
