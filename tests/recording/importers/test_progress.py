"""Progress, interrupts and ready commands of an import, and one reading for a list of columns."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.cli.output import with_hints
from dearig.errors import InputError, hints_of
from dearig.recording import import_file, open_recording
from dearig.recording.importers import ImportOptions
from dearig.recording.importers.columns.specimen import Specimen
from dearig.recording.importers.formats import text_file
from dearig.recording.importers.listing import Guessed, content_of, preview
from tests.tools.imports import MOVED, TABLE, TIME, VOLTAGE


def csv(folder: Path) -> Path:
    path = folder / "in.csv"
    np.savetxt(path, TABLE, delimiter=",", header="time_s,voltage_V,displacement_mm", comments="")
    return path


def hdf5(folder: Path) -> Path:
    path = folder / "in.hdf5"
    with h5py.File(path, "w") as file:
        for name, values in (("time_s", TIME), ("voltage_V", VOLTAGE), ("displacement_m", MOVED)):
            file[name] = values
    return path


def excel(folder: Path) -> Path:
    from openpyxl import Workbook

    path, book = folder / "in.xlsx", Workbook(write_only=True)
    sheet = book.create_sheet()
    sheet.append(["time_s", "voltage_V", "displacement_mm"])
    for row in TABLE:
        sheet.append(row.tolist())
    book.save(path)
    return path


@pytest.mark.parametrize("make", [csv, hdf5, excel])
def test_progress_goes_forward_from_the_opening_to_the_end(
    make: Callable[[Path], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dearig.recording.importers.formats.excel_file.REPORTED", 10)
    told: list[tuple[str, float]] = []
    import_file(make(tmp_path), tmp_path / "out.h5", progress=lambda s, f: told.append((s, f)))
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["opening", "reading", "checking", "writing"]
    parts = [part for _, part in told]
    assert parts == sorted(parts)
    assert parts[0] == 0.0
    assert 0.0 < parts[2] < parts[-1] <= 1.0


@pytest.mark.parametrize("stage", ["opening", "reading", "checking", "writing"])
def test_an_interrupt_leaves_nothing_behind(stage: str, tmp_path: Path) -> None:
    def interrupt(now: str, _: float) -> None:
        if now == stage:
            raise KeyboardInterrupt

    path = csv(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        import_file(path, tmp_path / "out.h5", progress=interrupt)
    assert list(tmp_path.iterdir()) == [path]


def test_columns_are_listed_in_one_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readings = []
    read = text_file.blocks_of

    def counted(*given: object) -> object:
        readings.append(given)
        return read(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(text_file, "blocks_of", counted)
    path = tmp_path / "in.csv"
    # a text among the columns, cells that are not numbers, and a row that is too short
    path.write_text(
        "time_s,state,voltage_V,displacement_mm\n0,idle,0,1.5\n1,on,5,2.5\n2,on,-,OVER\n3,on\n"
        "4,off,9,4.5\n"
    )
    found = preview(path)
    assert len(readings) == 1
    assert [(c.name, c.count, c.values) for c in found] == [
        ("time_s", 5, (0.0, 1.0, 2.0, 3.0, 4.0)),
        ("state", 0, ()),
        ("voltage_V", 3, (0.0, 5.0, 9.0)),
        ("displacement_mm", 3, (1.5, 2.5, 4.5)),
    ]
    assert (found[3].low, found[3].high) == (1.5, 4.5)


def command_in(error: InputError) -> list[str]:
    found = re.search(r"run: (dearig import .*)", with_hints(error))
    assert found is not None
    return shlex.split(found[1])


def film(folder: Path) -> Path:
    path = folder / "film.csv"
    rows = "\n".join(f"{i / 10},{i / 20},{i / 50}" for i in range(30))
    path.write_text(
        f"Gauge length: 30 mm\nSpecimen Cross-section (cm^2),0.18\n"
        f"Time (s),Travel (mm),Force (N)\n{rows}\n"
    )
    return path


def test_sizes_of_the_specimen_are_asked_for_at_once_with_what_the_file_tells(
    tmp_path: Path,
) -> None:
    path, out = film(tmp_path), tmp_path / "out.h5"
    with pytest.raises(InputError, match=r"no stretch.*and force") as caught:
        import_file(path, out, ImportOptions(typed=(("film", "a 1"),)))
    words = command_in(caught.value)
    assert words[:5] == ["dearig", "import", str(path), "--out", str(out)]
    assert set(hints_of(caught.value)[0].options) == {"gauge_length_mm", "area_mm2"}
    assert words[5:] == ["--film", "a 1", "--gauge-length-mm", "30", "--area-mm2", "18"]
    assert not out.exists()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda text: text + "End of test\n", ["--skip-bad-rows"]),
        (lambda text: text.replace("0.05", "0.04"), ["--skip-bad-rows"]),
        (lambda text: re.sub(r"(?m)^[^,]*,", "", text), ["--rate-Hz", "RATE"]),
    ],
)
def test_what_would_help_is_printed_as_a_command(
    spoil: Callable[[str], str], words: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "in.csv"
    rows = "\n".join(f"{i / 100:.2f},{i * 10},{i / 50}" for i in range(30))
    path.write_text(spoil(f"time_s,voltage_V,displacement_mm\n{rows}\n"))
    with pytest.raises(InputError) as caught:
        import_file(path, tmp_path / "out.h5", ImportOptions(columns={"voltage_V": "voltage_V"}))
    assert command_in(caught.value)[5:] == ["--column", "voltage_V=voltage_V", *words]


def test_a_scale_that_overrules_the_unit_of_a_name_is_said(tmp_path: Path) -> None:
    path = csv(tmp_path)
    out = tmp_path / "out.h5"
    said = import_file(path, out, ImportOptions(columns={"displacement_mm": "displacement_mm*-2"}))
    assert "displacement in mm from 'displacement_mm', scaled *-2" in said.columns
    assert any("although its name says mm" in note for note in said.notes)
    assert any("its sign right" in doubt for doubt in said.warnings)
    np.testing.assert_allclose(open_recording(out).displacement, -2.0 * MOVED, rtol=1e-9, atol=1e-9)
    # the same unit said in another way is not a contradiction
    options = ImportOptions(columns={"displacement_um": "displacement_mm*1000"})
    assert not any("although" in n for n in import_file(path, out, options, overwrite=True).notes)


def test_only_what_is_given_is_taken_without_guesses(tmp_path: Path) -> None:
    path = csv(tmp_path)
    options = ImportOptions(columns={"voltage_V": "voltage_V"}, guess=False)
    with pytest.raises(InputError, match="no column for displacement"):
        import_file(path, tmp_path / "out.h5", options)


def test_the_content_has_guesses_with_their_doubts(tmp_path: Path) -> None:
    path = tmp_path / "in.csv"
    rows = "\n".join(f"{i / 10},{i},{i},{i}" for i in range(30))
    path.write_text(f"Time (s),Laser (V),Voltage,Force\n{rows}\n")
    found = content_of(path)
    assert found.proposals[""].guesses == {
        1: Guessed("time", "s"),
        2: Guessed("displacement", "", "scale"),
        3: Guessed("voltage", "", "unit"),
    } | {n: g for n, g in found.proposals[""].guesses.items() if n == 4}
    assert content_of(film(tmp_path)).stated == Specimen(30.0, 18.0)
    # the same names and units have the same signature, whatever the values
    other = tmp_path / "other.csv"
    other.write_text(path.read_text().replace("0.1", "0.15"))
    same = content_of(other).proposals[""].signature
    assert same == found.proposals[""].signature
    other.write_text(path.read_text().replace("Laser (V)", "Laser (mV)"))
    assert content_of(other).proposals[""].signature != same
