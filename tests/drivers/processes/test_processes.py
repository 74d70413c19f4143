"""Child processes in a folder whose files have the names of modules."""

import ast
import multiprocessing
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dearig.drivers
import dearig.model
import dearig.sim_backend
from dearig.config.rigfile import RigFile
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.guardian import GuardianProcess
from dearig.drivers.errors import RigError
from dearig.drivers.processes.children import (
    child_environment,
    child_path,
    has_unread,
    isolated,
    isolated_spawn,
)
from tests.tools.daqmx import served

NAMES = ("queue", "numbers", "struct", "selectors", "socket", "drivers", "app", "model", "pydantic")


@pytest.fixture
def decoys(tmp_path, monkeypatch):
    """The working folder, first on the path, with files that no program of ours may import."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f'raise ImportError("the decoy {name}")\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    return tmp_path


@pytest.mark.parametrize("entry", ["", ".", "{folder}", "{folder}/"])
def test_path_of_a_child_lacks_the_working_folder(tmp_path, monkeypatch, entry):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry.format(folder=tmp_path), "/elsewhere"])
    assert child_path() == ["/elsewhere"]


def test_working_folder_that_holds_the_program_stays_on_the_path(tmp_path, monkeypatch):
    try:
        (tmp_path / "dearig").symlink_to(dearig.__path__[0], target_is_directory=True)
    except OSError:
        pytest.skip("this account may not make links")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), "/elsewhere"])
    assert child_path() == [str(tmp_path), "/elsewhere"]


def test_deleted_working_folder_is_no_error(tmp_path, monkeypatch):
    folder = tmp_path / "deleted"
    folder.mkdir()
    monkeypatch.chdir(folder)
    try:
        folder.rmdir()
    except OSError:
        pytest.skip("this system keeps a folder in which somebody works")
    monkeypatch.setattr(sys, "path", ["", ".", "/elsewhere"])
    assert child_path() == ["/elsewhere"]
    assert child_environment()["PYTHONPATH"] == "/elsewhere"


def test_guardian_starts_beside_decoys(decoys, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(("", ".", str(decoys))))
    with served() as bench:
        guardian = GuardianProcess(Address("Dev1", f"127.0.0.1:{bench.server.port}"), RigFile())
        guardian.arm()
        assert guardian.beat()
        guardian.disarm()
        guardian.close()


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    """A working folder that has everything a process might import from it; each leaves a mark."""
    mark = tmp_path / "imported"
    code = f"import pathlib; pathlib.Path({str(mark)!r}).touch()\n"
    packages = ("dearig", "dearig/drivers", "dearig/drivers/daqmx", "drivers", "drivers/daqmx")
    modules = ("queue", "sitecustomize", "usercustomize", "startup", "grpc", "nidaqmx", "isolated")
    files = [f"{name}.py" for name in (*NAMES, *modules)]
    for folder in ("", "relative"):
        for file in files:
            path = tmp_path / folder / file
            path.parent.mkdir(exist_ok=True)
            path.write_text(code)
    for package in packages:
        for name in ("__init__.py", "guardian_process.py", "sources.py"):
            path = tmp_path / package / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(code)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(("", ".", "relative")))
    monkeypatch.setenv("PYTHONSTARTUP", "startup.py")
    monkeypatch.setattr(
        sys, "path", ["", str(tmp_path), str(tmp_path / "relative"), "relative", *sys.path]
    )
    return mark


def test_guardian_imports_nothing_from_a_hostile_folder(hostile):
    with served() as bench:
        guardian = GuardianProcess(Address("Dev1", f"127.0.0.1:{bench.server.port}"), RigFile())
        guardian.arm()
        guardian.disarm()
        guardian.close()
    assert not hostile.exists()


def test_guardian_starts_in_a_deleted_folder(tmp_path, monkeypatch):
    folder = tmp_path / "deleted"
    folder.mkdir()
    monkeypatch.chdir(folder)
    try:
        folder.rmdir()
    except OSError:
        pytest.skip("this system keeps a folder in which somebody works")
    with served() as bench:
        guardian = GuardianProcess(Address("Dev1", f"127.0.0.1:{bench.server.port}"), RigFile())
        guardian.arm()
        guardian.disarm()
        guardian.close()


def test_guardian_starts_from_the_folder_that_holds_the_program(tmp_path, monkeypatch):
    try:
        (tmp_path / "dearig").symlink_to(dearig.__path__[0], target_is_directory=True)
    except OSError:
        pytest.skip("this account may not make links")
    (tmp_path / "queue.py").write_text('raise ImportError("the decoy queue")\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    with served() as bench:
        guardian = GuardianProcess(Address("Dev1", f"127.0.0.1:{bench.server.port}"), RigFile())
        guardian.arm()
        guardian.disarm()
        guardian.close()


@pytest.mark.skipif(sys.platform == "win32", reason="it is not known there")
def test_pipe_with_unread_data_is_told_from_an_empty_and_a_closed_one():
    ours, theirs = os.pipe()
    with os.fdopen(ours, encoding="utf-8") as pipe:
        assert not has_unread(pipe)
        os.write(theirs, b"heard\n")
        assert has_unread(pipe)
        pipe.readline()
        assert not has_unread(pipe)
        os.close(theirs)
    assert not has_unread(pipe)


def test_spawned_worker_starts_beside_decoys(decoys, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(decoys))
    before = sys.path.copy(), dict(os.environ)
    process = multiprocessing.get_context("spawn").Process(target=sys.exit, args=(7,))
    with isolated_spawn():
        process.start()
    process.join()
    assert process.exitcode == 7
    assert (sys.path, dict(os.environ)) == before


def test_spawned_worker_starts_from_a_main_module_of_the_working_folder(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import multiprocessing, sys\n"
        "from dearig.drivers.processes.children import isolated_spawn\n"
        "if __name__ == '__main__':\n"
        "    spawn = multiprocessing.get_context('spawn')\n"
        "    process = spawn.Process(target=sys.exit, args=(7,))\n"
        "    with isolated_spawn():\n"
        "        process.start()\n"
        "    process.join()\n"
        "    sys.exit(process.exitcode)\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "mine"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 7, done.stderr


def test_guardian_that_cannot_import_says_why(tmp_path, monkeypatch):
    broken = tmp_path / "isolated.py"
    broken.write_text('raise ImportError("pydantic is broken")\n')
    monkeypatch.setattr(isolated, "__file__", str(broken))
    with pytest.raises(RigError, match=r"has ended \(exit code 1, ImportError: pydantic is bro"):
        GuardianProcess(Address("Dev1"), RigFile())


def _beat_until_it_is_dead(guardian):
    while guardian.beat():
        pass
    guardian.arm()


def test_guardian_that_was_killed_is_not_armed_and_says_so():
    with served() as bench:
        guardian = GuardianProcess(Address("Dev1", f"127.0.0.1:{bench.server.port}"), RigFile())
        os.kill(guardian.pid, 9)
        with pytest.raises(RigError, match=r"gives no answer \(exit code -?\d+"):
            _beat_until_it_is_dead(guardian)
        guardian.close()


def test_guardian_without_a_card_says_what_it_lacks():
    with pytest.raises(RigError, match="does not work: card Dev1: NI-DAQmx"):
        GuardianProcess(Address("Dev1"), RigFile())


def test_every_child_process_of_the_program_gets_this_environment():
    started = []
    packages = (dearig, dearig.drivers, dearig.model, dearig.sim_backend)
    folders = [Path(package.__path__[0]) for package in packages]
    for source in sorted(path for folder in folders for path in folder.rglob("*.py")):
        text = source.read_text(encoding="utf-8")
        if not re.search(r"subprocess\.|get_context|isolated_command\(", text):
            continue
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.Call):
                continue
            call = ast.unparse(node)
            if ast.unparse(node.func) in ("subprocess.Popen", "subprocess.run") and (
                "sys.executable" in call
            ):
                started.append(source.name)
                assert "'-P'" in call, source
                assert "env=child_environment()" in call, source
            if "isolated_command(" in call and ast.unparse(node.func) == "subprocess.Popen":
                started.append(source.name)
            if ast.unparse(node.func).endswith("get_context"):
                started.append(source.name)
                assert "with isolated_spawn():" in text, source
    assert {"guardian.py", "worker.py", "main.py"} <= set(started)
