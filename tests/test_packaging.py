"""The distribution: one complete wheel with one import name, deaf to the working folder's files."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from dearig.recording import open_recording
from tests.deep import mostly_deep
from tests.test_revision import git
from tests.tools.command import LOBE, SLOW_RIG, write

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
#: Folders of the checkout and the packages that they are imported as.
FOLDERS: dict[str, str] = {
    folder: name for name, folder in PROJECT["tool"]["setuptools"]["package-dir"].items()
}
#: Names of our folders, and of modules of the standard library that our code or NumPy's imports.
DECOYS = ("app", "model", "drivers", "sim_backend", "numbers", "queue", "random", "statistics")


def files_in(folder: Path) -> Iterator[Path]:
    """Every file that belongs to the project."""
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path


def test_every_folder_that_python_can_import_is_a_listed_package() -> None:
    # setuptools says of a folder of data that is not listed that it would be ignored
    found = {
        ".".join((name, *path.parent.relative_to(ROOT / folder).parts))
        for folder, name in FOLDERS.items()
        for path in files_in(ROOT / folder)
        if all(part.isidentifier() for part in path.parent.relative_to(ROOT / folder).parts)
    }
    assert found == set(PROJECT["tool"]["setuptools"]["packages"])


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy so that nothing is left in the checkout."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for folder in FOLDERS:
        shutil.copytree(
            ROOT / folder, source / folder, ignore=shutil.ignore_patterns("__pycache__")
        )
    for name in ("pyproject.toml", "setup.py", PROJECT["project"]["readme"], "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    git(source, "init", "-q")
    git(source, "add", ".")
    git(source, "commit", "-q", "-m", "Release")
    # as pip has it built, which would start two processes more
    built = subprocess.run(
        [
            sys.executable, "-P", "-c",
            f"import setuptools.build_meta as backend; backend.build_wheel({str(out)!r})",
        ],
        capture_output=True, text=True, check=False, cwd=source, timeout=200,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    (path,) = out.glob("*.whl")
    return path


def test_the_wheel_has_one_top_level_name_and_every_file(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if not name.endswith("/")}
    packed = {name for name in names if ".dist-info/" not in name}
    assert {name.partition("/")[0] for name in packed} == {"dearig"}
    expected = {
        "/".join((*name.split("."), *path.relative_to(ROOT / folder).parts))
        for folder, name in FOLDERS.items()
        for path in files_in(ROOT / folder)
    }
    assert packed == expected | {"dearig/revision.json"}
    assert "dearig/py.typed" in packed
    for ending in (".j2", ".png", ".md"):
        assert any(name.endswith(ending) for name in packed), ending


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment with the wheel; dependencies are those of this environment."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    venv.create(folder, with_pip=False, symlinks=os.name != "nt")
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    subprocess.run(
        [
            sys.executable, "-P", "-m", "pip", "--python", str(python), "install", "--quiet",
            "--no-compile", "--no-deps", "--no-index", "--disable-pip-version-check", str(wheel),
        ],
        check=True, timeout=200,
    )  # fmt: skip
    # a folder named in a .pth file is searched, but its own .pth files are not read: the editable
    # install of the checkout stays unknown
    packages = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    purelib = subprocess.run(
        [str(python), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
        capture_output=True, text=True, check=True,
    ).stdout.strip()  # fmt: skip
    write(Path(purelib) / "dependencies.pth", "\n".join(packages) + "\n")
    return python


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A working folder with a sequence, a rig file, and files named after modules."""
    for name in DECOYS:
        write(tmp_path / f"{name}.py", "raise SystemExit(f'{__file__} was imported')\n")
    # without compiled kernels each second of a run takes one
    write(tmp_path / "lobe.toml", LOBE.replace("frequency_Hz = 1.0", "frequency_Hz = 5.0"))
    write(tmp_path / "rig.toml", SLOW_RIG + '[film]\nname = "F 3"\n')
    return tmp_path


@pytest.mark.deep
def test_the_installed_program_names_the_revision_of_its_build(
    installed: Path, folder: Path
) -> None:
    said = run(folder, installed, "-m", "dearig", "--version").stdout
    version = re.escape(PROJECT["project"]["version"])
    assert re.fullmatch(rf"dearig {version}, revision [0-9a-f]{{40}}\n", said), said


def environment(tmp_path: Path) -> dict[str, str]:
    # a compilation for this one installation would take a minute
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return {**kept, "NUMBA_DISABLE_JIT": "1", "DEARIG_LOG_DIR": str(tmp_path / "log")}


def run(folder: Path, *command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, cwd=folder,
        env=environment(folder), timeout=200,
    )  # fmt: skip


def test_it_is_the_installed_package_that_runs(installed: Path, folder: Path) -> None:
    """Otherwise the tests below would prove nothing."""
    ended = run(folder, installed, "-P", "-c", "import dearig; print(dearig.__file__)")
    assert Path(ended.stdout.strip()).is_relative_to(installed.parents[1])


_PICTURES = """
import re
from PySide6.QtCore import QUrl
from PySide6.QtGui import QTextDocument
from PySide6.QtWidgets import QApplication
application = QApplication([])
from dearig.window.shell.guide import Guide
guide = Guide()
kind = QTextDocument.ResourceType.ImageResource.value
names = re.findall('<img src="([^"]+)"', guide.text.document().toHtml())
at = guide.text.source()
sizes = [guide.text.loadResource(kind, at.resolved(QUrl(name))).width() for name in names]
print(len(names), min(sizes))
"""


def test_the_guide_of_the_installed_window_has_its_pictures(installed: Path, folder: Path) -> None:
    """F1 opens the documents of the package; a picture that is missing is one pixel wide."""
    ended = subprocess.run(
        [str(installed), "-P", "-c", _PICTURES], capture_output=True, text=True, check=False,
        cwd=folder, env=environment(folder) | {"QT_QPA_PLATFORM": "offscreen"}, timeout=200,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    count, smallest = map(int, ended.stdout.split())
    assert count >= 6
    assert smallest > 300


@pytest.mark.parametrize("way", mostly_deep(["command", "python -m"], ["command"]))
def test_it_records_beside_files_named_after_modules(
    installed: Path, folder: Path, way: str
) -> None:
    command: list[str | Path] = [installed, "-m", "dearig"]
    if way == "command":
        command = [installed.with_name("dearig.exe" if os.name == "nt" else "dearig")]
    ended = run(
        folder, *command, "record", "lobe.toml", "--rig-file", "rig.toml", "--out", "run.h5"
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    recording = open_recording(folder / "run.h5")
    assert recording.complete
    assert recording.samples == 141


@pytest.mark.deep
@pytest.mark.slow
@pytest.mark.timeout(900)  # the simulated card may have to compile its kernels first
def test_it_records_from_a_card_with_its_guardian_beside_such_files(
    installed: Path, folder: Path
) -> None:
    """The guardian is a process of its own, which Python starts in the same working folder."""
    # the card is simulated by this environment, whose kernels are compiled: a client gives up on
    # a card that is as slow as without
    serve = [
        sys.executable,
        "-P",
        "-m",
        "dearig",
        "serve-daqmx",
        "--fast",
        "--rig-file",
        "rig.toml",
    ]
    with subprocess.Popen(
        [*serve, "--client-timeout", "60", "--link-timeout", "60"],
        stdout=subprocess.PIPE, text=True, cwd=folder,
    ) as server:  # fmt: skip
        try:
            assert server.stdout is not None
            line = server.stdout.readline()
            assert "simulated card at" in line
            rig = line.partition("--rig ")[2].partition(";")[0]
            ended = run(
                folder, installed, "-m", "dearig", "record", "lobe.toml", "--rig", rig,
                "--rig-file", "rig.toml", "--out", "run.h5",
            )  # fmt: skip
        finally:
            server.terminate()
    assert ended.returncode == 0, ended.stderr
    assert open_recording(folder / "run.h5").complete
