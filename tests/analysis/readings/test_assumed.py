"""Values of the film and the load that no recording says: they are told, not assumed in silence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.readings.compatibility import assumed_by
from dearig.config.imports import imported_metadata
from dearig.config.rigfile import RigFile
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.recording import RunMetadata, import_file, open_recording
from dearig.recording.importers import ImportOptions
from dearig.recording.reading.recording import Recording
from dearig.report.as_json import diagnosis_json, outcome_json
from dearig.report.text.diagnosis import warnings
from dearig.report.text.sentences import warnings_of
from tests.tools.diagnosis import diagnose_outcome
from tests.tools.recordings import Clock
from tests.tools.reports import identify_outcome


def recorded(folder: Path, metadata: RunMetadata, **options: object) -> Recording:
    time = np.arange(60) / 100.0
    volts = np.where(time < 0.3, 0.0, 4000.0 * (time - 0.3))
    rows = zip(time, volts, 0.1 * (volts / 1e3) ** 2, strict=True)
    path, out = folder / "in.csv", folder / "run.h5"
    lines = ["time_s,voltage_V,displacement_mm", *(f"{t},{v},{d}" for t, v, d in rows)]
    path.write_text("\n".join(lines), "utf-8")
    import_file(path, out, ImportOptions(**options), metadata=metadata, overwrite=True, now=Clock())
    return open_recording(out)


WHOLE = "75 mm long, 72 mm wide, 1000 um thick, relative permittivity 4.7, constrained-width"


@pytest.mark.parametrize(
    ("given", "kinematics", "words"),
    [
        ({}, None, f"the film ({WHOLE}) and the load (200 g) of the thesis"),
        ({}, "uniaxial", f"the film ({WHOLE.rpartition(', ')[0]}) and the load (200 g) of the"),
        ({"length_mm": 50.0, "load_g": 100.0}, None,
         f"the film ({WHOLE.partition(', ')[2]}) of the thesis"),
        ({"length_mm": 50.0, "width_mm": 50.0, "thickness_um": 500.0, "permittivity": 4.7},
         "uniaxial", "Assumed, because the recordings do not say it: the load (200 g) of the"),
    ],
)  # fmt: skip
def test_values_that_were_not_given_are_told(
    tmp_path: Path, given: dict[str, float], kinematics: str | None, words: str
) -> None:
    metadata = imported_metadata("", None, "", "", **given, kinematics=kinematics)
    run = recorded(tmp_path, metadata, kinematics=kinematics)
    assert words in assumed_by([run], None)
    assert assumed_by([run], RigFile()) == ""
    note = next(e.message for e in run.events if e.message.startswith("fits of these data take"))
    assert words.partition(": ")[2] in note or words.partition(" of the thesis")[0] in note
    if kinematics:
        assert run.film is None or run.film.kinematics == kinematics
        assert "constrained-width" not in assumed_by([run], None)


def test_nothing_is_assumed_of_a_whole_recording(tmp_path: Path) -> None:
    run = recorded(tmp_path, RunMetadata(film=THESIS_FILM, load=THESIS_LOAD))
    assert assumed_by([run], None) == ""


def test_fits_have_it_in_their_output_json_and_report() -> None:
    sentence = "Assumed, because the recordings do not say it: the load (200 g) of the thesis"
    fit = replace(identify_outcome(), assumed=sentence)
    assert f"{sentence}." in warnings_of(fit)
    assert outcome_json(fit)["assumed"] == sentence
    found = replace(diagnose_outcome(), assumed=sentence)
    assert f"{sentence}." in warnings(found)
    assert diagnosis_json(found)["assumed"] == sentence
