"""The command itself: version, unexpected errors, completion."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from dearig.cli.main import main
from tests.tools.command import done

PROGRAM = [sys.executable, "-m", "dearig"]


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*PROGRAM, *arguments], capture_output=True, text=True, check=False, timeout=120,
        env={**os.environ, **environment},
    )  # fmt: skip


def test_version() -> None:
    said = f"dearig {metadata.version('dearig')}"
    assert done("--version").out.rstrip("\n").split(", ")[0] == said


# ---------------------------------------------------------------- unexpected errors


def ended(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    monkeypatch.setattr(sys, "argv", ["dearig", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code


def broken(*_: object, **__: object) -> None:
    raise KeyError("a secret of\nthe program")


def test_an_unexpected_error_is_one_sentence_and_its_traceback_is_in_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DEARIG_LOG_DIR", str(tmp_path))
    monkeypatch.setattr("dearig.config.rigfile.write_default", broken)
    assert ended(monkeypatch, "rig-file", "x.toml") == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("dearig: unexpected error")
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    log = tmp_path / "dearig.log"
    assert str(log) in said.err
    text = log.read_text(encoding="utf-8")
    assert "Traceback" in text
    assert "in broken" in text
    assert "started: dearig rig-file x.toml" in text
    assert f"dearig {metadata.version('dearig')}, Python {sys.version.split()[0]}" in text
    assert text.splitlines()[-1].endswith("ended with exit code 1")


def wrapped(error: Exception) -> Exception:
    """Return the error of a library that had ``error`` and says something else of it."""
    other = OSError("Could not find or load the library")
    other.__context__ = error
    return other


@pytest.mark.parametrize(
    ("lack", "said"),
    [
        (MemoryError(), "no memory left"),
        (ValueError("Unable to create dataset (unable to allocate buffer)"), "no memory left"),
        (KeyError("Unable to open object (memory allocation failed)"), "no memory left"),
        (SystemError("error return without exception set"), "no memory left"),
        (SyntaxError("invalid syntax", (__file__, 1, 1, "", 1, 1)), "no memory left"),
        (SyntaxError("invalid syntax", ("<string>", 4, 1, "", 4, 1)), "no memory left"),
        (ImportError("libx.so: failed to map segment from shared object"), "no memory left"),
        (RuntimeError("can't start new thread"), "no memory left"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "no memory left"),
        (wrapped(ImportError("libx.so: failed to map segment")), "no memory left"),
        (OSError(errno.ENOSPC, "full"), "free some space"),
    ],
    ids=[
        "memory",
        "HDF5",
        "HDF5 2",
        "memory for an error",
        "memory for a parser",
        "made code",
        "address space",
        "thread",
        "memory for a file",
        "wrapped by a library",
        "disk",
    ],
)
def test_a_computer_without_memory_or_disk_is_no_mistake_of_the_program(
    lack: Exception,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def exhausted(*_: object, **__: object) -> None:
        raise lack

    monkeypatch.setenv("DEARIG_LOG_DIR", str(tmp_path))
    monkeypatch.setattr("dearig.config.rigfile.write_default", exhausted)
    assert ended(monkeypatch, "rig-file", "x.toml") == 4
    errors = capsys.readouterr().err
    assert said in errors
    assert "mistake" not in errors
    assert errors.count("\n") == 1
    assert "Traceback" in (tmp_path / "dearig.log").read_text(encoding="utf-8")


def test_without_a_log_file_it_says_how_to_see_the_details(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("DEARIG_LOG_DIR", str(tmp_path / "file"))
    monkeypatch.setattr("dearig.config.rigfile.write_default", broken)
    assert ended(monkeypatch, "rig-file", "x.toml") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot be written" in line
    assert line.endswith("dearig -v shows the details")
    assert ended(monkeypatch, "-v", "rig-file", "x.toml") == 1
    assert "in broken" in capsys.readouterr().err


def test_an_error_in_a_thread_is_told_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from threading import Thread

    def in_a_thread(*_: object, **__: object) -> None:
        thread = Thread(target=broken)
        thread.start()
        thread.join()

    monkeypatch.setenv("DEARIG_LOG_DIR", str(tmp_path))
    monkeypatch.setattr("dearig.config.rigfile.write_default", in_a_thread)
    assert ended(monkeypatch, "rig-file", "x.toml") == 0
    assert "dearig: unexpected error" in capsys.readouterr().err
    assert "in broken" in (tmp_path / "dearig.log").read_text(encoding="utf-8")


def test_an_expected_error_is_in_the_log_without_a_traceback(tmp_path: Path) -> None:
    assert run("info", "no.h5", DEARIG_LOG_DIR=str(tmp_path)).returncode == 2
    text = (tmp_path / "dearig.log").read_text(encoding="utf-8")
    assert "no.h5 is not there" in text
    assert "Traceback" not in text


# ---------------------------------------------------------------- completion


@pytest.mark.parametrize(
    ("shell", "word"),
    [
        ("bash", "complete -o default -F _dearig_completion dearig"),
        ("zsh", "#compdef dearig"),
        ("fish", "complete --command dearig"),
        ("pwsh", "Register-ArgumentCompleter -Native -CommandName dearig"),
    ],
)
def test_a_completion_script_is_produced(shell: str, word: str) -> None:
    # a person's shell is found by its process; a test is started by none, and names it
    found = run("--show-completion", shell, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert found.returncode == 0
    assert word in found.stdout


def test_completion_leaves_no_trace_in_the_log(tmp_path: Path) -> None:
    found = run(
        COMP_WORDS="dearig ser", COMP_CWORD="1", _DEARIG_COMPLETE="complete_bash",
        DEARIG_LOG_DIR=str(tmp_path),
    )  # fmt: skip
    assert found.stdout.split() == ["serve-daqmx"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["dearig", "va"], {"validate"}),
        (["dearig", "export", "x.h5", "--to", ""], {"csv", "mat", "parquet"}),
    ],
)
def test_bash_completes_commands_and_choices(
    tmp_path: Path, words: list[str], expected: set[str]
) -> None:
    """The script is read by a bash, and its function asked as the shell asks it."""
    command = tmp_path / "dearig"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m dearig "$@"\n')
    command.chmod(0o755)
    asked = " ".join(f"'{word}'" for word in words)
    script = (
        f'PATH="{tmp_path}:$PATH"\n'
        'eval "$(dearig --show-completion bash)"\n'
        f"COMP_WORDS=({asked}); COMP_CWORD={len(words) - 1}\n"
        "_dearig_completion dearig\n"
        'printf "%s\\n" "${COMPREPLY[@]}"\n'
    )
    ended = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, check=False, timeout=120
    )
    assert set(ended.stdout.split()) == expected, ended.stderr
