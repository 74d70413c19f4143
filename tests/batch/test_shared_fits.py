"""Studies in which the recordings of a film share parameters: who is fitted with whom, and rows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from dearig.analysis.shared import SharedOutcome, identify_shared
from dearig.batch import shared_fits
from dearig.batch.engines import LocalEngine, engine_at
from dearig.batch.fits import StudyOptions
from dearig.batch.shared_fits import fit_film
from dearig.batch.studies import StudyTable, study_films, subjects_of, with_model
from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.model.fitting import Estimate
from dearig.recording.reading.recording import Recording
from tests.tools.recordings import run_counts, writer

FILMS = {"a.h5": "F1", "b.h5": "F1", "c.h5": "F2", "d.h5": ""}
OPTIONS = StudyOptions("identify", own=("mu_0", "permittivity"))


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of two films, one without the name of a film, and a broken one."""
    folder = tmp_path_factory.mktemp("films")
    for i, (name, film) in enumerate(FILMS.items()):
        counts = run_counts(400, quiet=100, seed=i)
        with writer(folder / name, samples_expected=400, film_id=film) as recorder:
            recorder.append(Block(0, counts, ()))
    return folder


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Films fitted together by names; the fit itself is one of the model's tests."""
    together: list[list[str]] = []

    def identify(
        recordings: list[Recording], own: tuple[str, ...], **_: object
    ) -> list[SharedOutcome]:
        paths = [recording.path for recording in recordings]
        together.append([path.name for path in paths])
        assert own == OPTIONS.own
        if paths[0].name == "c.h5":
            raise InputError(f"{paths[0]}: too few samples")
        numbers = (
            Estimate("mu_0", "Pa", 45e3, 44e3, 46e3, True),
            Estimate("permittivity", "", 4.7, 4.6, 4.8, True),
        )
        return [SharedOutcome(path, numbers, None, True) for path in paths]  # type: ignore[arg-type]

    monkeypatch.setattr(shared_fits, "identify_shared", identify)
    monkeypatch.setattr(shared_fits, "errors_of", lambda _: {"rms_um": 1.0})
    monkeypatch.setattr(shared_fits, "rejection_of", lambda _: {"rejected": False})
    return together


@pytest.fixture
def table(shelf: Path, tmp_path: Path) -> Callable[[], StudyTable]:
    def study() -> StudyTable:
        return study_films(
            subjects_of([shelf], tmp_path), OPTIONS, tmp_path, LocalEngine(1, fit_film)
        )

    return study


def test_recordings_are_fitted_with_those_of_their_film_and_computed_once(
    fitted: list[list[str]], table: Callable[[], StudyTable]
) -> None:
    found = table()
    assert fitted == [["a.h5", "b.h5"], ["c.h5"]]
    rows = {row["recording"]: row for row in found.rows}
    assert {name: row["state"] for name, row in rows.items()} == {
        "a.h5": "ok", "b.h5": "ok", "c.h5": "failed", "d.h5": "failed"
    }  # fmt: skip
    assert (rows["a.h5"]["mu_0_kPa"], rows["a.h5"]["permittivity_low95"]) == (45.0, 4.6)
    assert rows["b.h5"]["fitted_together"] == 2
    assert rows["c.h5"]["reason"] == "c.h5: too few samples"
    assert "does not name its film" in rows["d.h5"]["reason"]
    again = table()
    assert len(fitted) == 2
    assert again.cached == 3
    assert again.rows == found.rows


def test_other_options_of_the_fit_do_not_share_parameters(shelf: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="are for identify; diagnose shares none"):
        with_model(StudyOptions("diagnose", own=("mu_0",)), None)


@pytest.mark.filterwarnings("ignore")
def test_films_are_fitted_on_a_cluster_as_here(
    shelf: Path, fitted: list[list[str]], table: Callable[[], StudyTable], tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed", reason='takes the extra "cluster"')
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    ) as cluster:
        engine = engine_at(f"dask:{cluster.scheduler_address}", work=fit_film)
        there = study_films(subjects_of([shelf], tmp_path / "d"), OPTIONS, tmp_path / "d", engine)
    assert sorted(fitted) == [["a.h5", "b.h5"], ["c.h5"]]
    assert there.table.read_bytes() == table().table.read_bytes()


def test_a_parameter_that_the_model_lacks_is_named(shelf: Path) -> None:
    with pytest.raises(InputError, match="mu_9 cannot be a parameter of each record"):
        identify_shared([shelf / "a.h5"], ["mu_9"])
