"""The cache of compiled kernels: trusted or not used, and never a reason to fail."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import dearig.model.kernel.drive as drive_kernel
from dearig.model import kernel
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation import film_kernel
from dearig.model.simulation.actuator import Actuator, Drive, reading_of
from dearig.model.simulation.strip import Strip
from tests.deep import mostly_deep

#: A kernel of its own file: numba keeps it in the folder that ``jit`` chose.
KERNEL = """
from dearig.model.compiled.jit import jit

@jit
def twice(x):
    return 2.0 * x

@jit
def thrice(x):
    return 3.0 * x
"""
RUN = """
import sys
sys.path.insert(0, {folder!r})
from dearig.model.compiled.jit import cache_folder, cache_note
import kernel
{before}
print(kernel.twice(21.0) + kernel.thrice(0.0))
print(cache_folder(), cache_note() or "usual", sep="\\n")
"""


def run(folder: Path, before: str = "", **environment: str) -> list[str]:
    """Value, cache folder and note of a process that compiles or reads the kernel."""
    if not (folder / "kernel.py").exists():
        (folder / "kernel.py").write_text(KERNEL, encoding="utf-8")
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA_", "XDG_"))}
    ended = subprocess.run(
        [sys.executable, "-c", RUN.format(folder=str(folder), before=before)],
        env={**clean, **environment}, cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    value, where, note = ended.stdout.splitlines()
    assert value == "42.0"  # of both kernels
    return [where, note]


class Planted:
    """A pickle that leaves a file where it is loaded."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, ...]:
        return Path.touch, (self.mark,)


def indices(cache: Path) -> list[Path]:
    return [p for p in cache.rglob("*.nbi") if p.name.startswith("kernel.twice")]


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the kernels and their ``cache``, which no test changes."""
    folder = tmp_path_factory.mktemp("filled")
    cache = folder / "cache"
    where, note = run(folder, NUMBA_CACHE_DIR=str(cache))
    assert Path(where).parent == cache.resolve()
    assert note == "usual"
    return folder


@pytest.fixture
def cache(filled: Path, tmp_path: Path) -> Path:
    """A copy of that cache, for a test that runs the kernels in ``filled``."""
    return Path(shutil.copytree(filled / "cache", tmp_path / "cache"))


def test_a_kernel_is_kept_and_found_again(filled: Path) -> None:
    assert len(indices(filled / "cache")) == 1


def test_a_kernel_is_compiled_again_when_a_neighbour_that_it_contains_changes(
    tmp_path: Path,
) -> None:
    neighbour = tmp_path / "neighbour.py"
    (tmp_path / "contains.py").write_text(
        "from dearig.model.compiled.jit import jit\nfrom neighbour import factor\n\n"
        "@jit\ndef scaled(x):\n    return factor() * x\n",
        encoding="utf-8",
    )
    values = []
    for factor in (2.0, 3.0):
        neighbour.write_text(
            f"from dearig.model.compiled.jit import jit\n\n@jit\ndef factor():\n"
            f"    return {factor}\n",
            encoding="utf-8",
        )
        ended = subprocess.run(
            [sys.executable, "-B", "-c", "import contains; print(contains.scaled(1.0))"],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            cwd=tmp_path, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert ended.returncode == 0, ended.stderr
        values.append(float(ended.stdout))
    assert values == [2.0, 3.0]


def test_a_kernel_that_is_read_needs_nothing_of_what_compiles(tmp_path: Path) -> None:
    (tmp_path / "arrays.py").write_text(
        "import numpy as np\nfrom dearig.model.compiled.jit import allocating\n\n"
        "@allocating\ndef waves(n):\n    made = np.empty(n)\n    for i in range(n):\n"
        "        made[i] = np.sin(i + 1.0)\n    return made[0] + made[n - 1]\n\n"
        "@allocating\ndef ones(n):\n    return np.ones(n).sum()\n",
        encoding="utf-8",
    )
    called = (
        "import sys, arrays; print(arrays.waves(3), 'numba.np.arraymath' in sys.modules);"
        "len(sys.argv) > 1 and print(arrays.ones(3))"
    )
    ended = [
        subprocess.run(
            [sys.executable, "-B", "-c", called, *more],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            cwd=tmp_path, capture_output=True, text=True, check=True,
        )
        for more in ((), ("one that must be compiled",))
    ]  # fmt: skip
    value = f"{np.sin(1.0) + np.sin(3.0)}"
    assert [e.stdout.split() for e in ended] == [[value, "True"], [value, "False", "3.0"]]


@pytest.mark.skipif(os.name == "nt", reason="modes of this kind are not there on Windows")
def test_planted_code_in_a_folder_that_others_may_write_to_is_not_run(
    tmp_path: Path, filled: Path, cache: Path
) -> None:
    mark = tmp_path / "mark"
    (index,) = indices(cache)
    index.write_bytes(pickle.dumps(Planted(mark)))
    cache.chmod(0o777)
    (tmp_path / "tmp").mkdir()
    where, note = run(filled, NUMBA_CACHE_DIR=str(cache), TMPDIR=str(tmp_path / "tmp"))
    assert not mark.exists()
    assert not Path(where).is_relative_to(cache)
    assert "everyone may write to" in note


@pytest.mark.skipif(os.name == "nt", reason="modes of this kind are not there on Windows")
@pytest.mark.deep
def test_a_planted_file_in_a_folder_that_was_open_once_is_not_run(
    tmp_path: Path, filled: Path, cache: Path
) -> None:
    mark = tmp_path / "mark"
    (index,) = indices(cache)
    index.write_bytes(pickle.dumps(Planted(mark)))
    index.chmod(0o666)
    where, note = run(filled, NUMBA_CACHE_DIR=str(cache))
    assert not mark.exists()
    assert where.endswith("-private")
    assert index.name in note


@pytest.mark.deep
def test_numbas_own_choice_of_folders_is_not_followed(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    run(tmp_path, NUMBA_CACHE_DIR=str(cache), NUMBA_CACHE_LOCATOR_CLASSES="InTreeCacheLocator")
    assert not (tmp_path / "__pycache__").exists() or not indices(tmp_path / "__pycache__")
    assert len(indices(cache)) == 1


@pytest.mark.parametrize(
    "damage", mostly_deep([b"", b"\x80", b"garbage", b"\x80\x05K\x01.rest"], [b"garbage"])
)
def test_a_damaged_cache_is_compiled_again(filled: Path, cache: Path, damage: bytes) -> None:
    """The index of one kernel is damaged, and the code of another."""
    (index,) = indices(cache)
    (data,) = (p for p in cache.rglob("*.nbc") if p.name.startswith("kernel.thrice"))
    whole = index.read_bytes()
    index.write_bytes(damage)
    data.write_bytes(damage)
    run(filled, NUMBA_CACHE_DIR=str(cache))
    assert index.read_bytes() == whole  # and kept, for the next time


@pytest.mark.deep
@pytest.mark.skipif(sys.platform != "linux", reason="a limit to the size of files is Linux's")
def test_a_full_disk_costs_time_and_no_result(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    full = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"
    )
    run(tmp_path, full, NUMBA_CACHE_DIR=str(cache))
    assert not indices(cache)


def test_without_a_cache_the_hooks_of_the_effects_are_compiled_from_memory(tmp_path: Path) -> None:
    nowhere = str(tmp_path / "file")
    Path(nowhere).touch()
    code = (
        "import dearig.model.compiled.trusted_folder as t; t._temporary = lambda: iter(());"
        "from dearig.model.compiled.jit import cache_folder; assert cache_folder() is None;"
        "from dearig.model.effects import assembly; assert callable(assembly.inertia)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "NUMBA_CACHE_DIR": f"{nowhere}/x"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr


def compiled_versions(*modules: ModuleType) -> int:
    """The number of argument types for which the kernels of ``modules`` are compiled here."""
    kernels = [v for m in modules for v in vars(m).values() if hasattr(v, "overloads")]
    return sum(len(k.overloads) for k in kernels)


def test_no_kernel_is_compiled_anew_for_arrays_that_cannot_be_written() -> None:
    """Those of a file cannot be written; whoever fits one first would wait half a minute more."""
    time = np.linspace(0.0, 0.1, 11)
    fixed, pulled = time.copy(), 1.0 + time
    fixed.flags.writeable = pulled.flags.writeable = False
    drag = (("linear drag", (("drag", 50.0),)),)
    film = Strip(TABLE_3, effects=drag)
    thesis = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    film.simulate(time, 1.0 + time)
    thesis.simulate(Drive(time, time))
    reading_of(thesis.coefficients(), 0.1, Drive(time, time), fidelity=kernel.QUICK)
    before = compiled_versions(film_kernel, drive_kernel)
    film.simulate(fixed, 1.0 + time)
    film.simulate(fixed, pulled)
    for hold in (True, False):
        drive = Drive(fixed, fixed, hold)
        thesis.simulate(drive)
        reading_of(thesis.coefficients(), 0.1, drive, fidelity=kernel.QUICK)
    assert compiled_versions(film_kernel, drive_kernel) == before
