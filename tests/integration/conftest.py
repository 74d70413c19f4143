"""What the tests of bad input share: files to give to a command, and a folder to run it in."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.tools.command import LOBE, SLOW_RIG, done, film_csv, film_model, thesis_model, write


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with good and bad files of every kind; tests only read it."""
    folder = tmp_path_factory.mktemp("shelf")
    write(folder / "lobe.toml", LOBE)
    rig = write(folder / "rig.toml", SLOW_RIG)
    light = write(folder / "light.toml", f"{SLOW_RIG}[load]\nmass_g = 150.0\n")
    thin = write(folder / "thin.toml", f"{SLOW_RIG}[film]\nthickness_mm = 0.9\n")
    for name, file in (("run", rig), ("light", light), ("thin", thin)):
        done("record", folder / "lobe.toml", "--out", folder / f"{name}.h5", "--rig-file", file)
    (folder / "copy.h5").write_bytes((folder / "run.h5").read_bytes())
    thesis_model(folder / "actuator.toml")
    film_model(folder / "film.toml")
    done("import", film_csv(folder / "film.csv", 0.1, 1), "--out", folder / "film.h5")
    done("import", folder / "film.csv", "--out", folder / "wide.h5", "--kinematics", "equibiaxial")

    def imported(name: str, head: str, rows: np.ndarray) -> None:
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=head, comments="")
        done("import", folder / f"{name}.csv", "--out", folder / f"{name}.h5")

    actuator, film = "time_s,voltage_V,displacement_mm", "time_s,stretch,nominal_stress_kPa"
    t = np.arange(200.0) / 50.0
    imported("still", actuator, np.column_stack([t, 1e3 * (t > 2.0), np.ones_like(t)]))
    imported("short", actuator, np.column_stack([t, 1e3 * t, 0.1 * t**2])[:3])
    imported("few", actuator, np.column_stack([t, 1e3 * t, 0.1 * np.sin(9.0 * t)])[:8])
    imported("still-film", film, np.column_stack([t, 1.0 + t, np.full_like(t, 5.0)]))

    raw = (folder / "run.h5").read_bytes()
    (folder / "cut.h5").write_bytes(raw[: len(raw) // 2])
    (folder / "text.h5").write_text("not one of ours")
    (folder / "empty.h5").touch()
    (folder / "empty.toml").touch()
    with h5py.File(folder / "foreign.h5", "w") as file:
        file["x"] = [1.0]
    return folder


@pytest.fixture
def bench(shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
