"""Names from files reach the terminal as text: nothing in them acts on it, on markup or on HTML."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from dearig.cli.console import PrintableConsole
from dearig.cli.progress_bar import progress
from dearig.drivers.rig import Block, Event
from dearig.printable import printable
from tests.deep import examples
from tests.tools.command import LOBE, Answer, dearig, done, thesis_model, write
from tests.tools.recordings import run_counts, write_run, writer

HOSTILE = "\x1b]0;owned\x07\x1b[2J\x9b31m\x7f\u202egnp.\u2066\n[bold red]x[/] :smile: \ud800"

#: Text with what a terminal, rich's markup or TOML might obey, and anything else.
TEXTS = st.one_of(
    st.text(alphabet=st.characters(exclude_characters="\0"), max_size=40),
    st.text(alphabet="\x1b[]0;m\x07\x9b\x7f\u202e\u2066\n\r\t :b/xA", max_size=40),
)
#: Text that a TOML file can hold: Unicode without lone surrogates.
FILE_TEXTS = TEXTS.map(lambda text: text.encode("utf-8", "replace").decode("utf-8"))


def told(answer: Answer) -> str:
    """Both texts of ``answer``, once they are known to be printable."""
    for text in (answer.out, answer.err):
        assert printable(text, "\n\t") == text
    return answer.out + answer.err


def titled(path: Path, text: str) -> Path:
    """A recording whose every free text is ``text``."""
    path.unlink(missing_ok=True)
    sequence = tomli_w.dumps(
        {"name": text or "x", "segment": [{"kind": "hold", "duration_s": 1.0}]}
    )
    counts = run_counts(200, quiet=100)
    about = {"operator": text, "film_id": text, "notes": text, "sequence_toml": sequence}
    with writer(path, samples_expected=200, **about) as recorder:
        recorder.append(Block(0, counts, (Event(10, "warning", text),)))
    return path


@pytest.mark.deep
@examples(15, suite=5)
@given(text=FILE_TEXTS)
def test_texts_of_a_recording(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("shelf")
    run = titled(folder / "run.h5", text)
    for command in (["info", run], ["info", "--verify", run], ["index", folder]):
        told(dearig(*command))
        answer = dearig(*command, "--json", "-")
        assert told(answer)
        assert answer.out.isascii()
        json.loads(answer.out)


@examples(25, suite=10)
@given(text=FILE_TEXTS, kind=st.sampled_from(["name", "key", "table", "kind", "line"]))
def test_faults_of_files_in_toml(
    text: str, kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("toml")
    segment = {"kind": "hold", "duration_s": -1.0}
    content = {
        "name": tomli_w.dumps({"name": text, "segment": [segment]}),
        "key": tomli_w.dumps({"name": "x", text: 1, "segment": [segment]}),
        "table": tomli_w.dumps({text: {text: text}}),
        "kind": tomli_w.dumps({"name": "x", "segment": [{**segment, "kind": text}]}),
        "line": f"name = 'x'\n{text}\n",
    }[kind]
    path = write(folder / "file.toml", content)
    model = folder / "model.toml"
    thesis_model(model)
    for command in (
        ["record", path, "--out", folder / "out.h5"],
        ["check", "--rig-file", path],
        ["simulate", path, "--drive", path, "--out", folder / "out.csv"],
    ):
        answer = dearig(*command)
        assert answer.code in (0, 2)
        told(answer)
        if answer.code == 2:
            assert answer.err.count("\n") == 1
        for made in folder.glob("out.*"):
            made.unlink()


@examples(15, suite=5)
@given(text=FILE_TEXTS)
def test_columns_of_a_table(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("csv")
    lines = f'"{text}",b,c\n0,1,2\n1,{text},3\n'
    path = write(folder / "in.csv", lines)
    for column in (f"time_s={text}", f"{text}=b", text):
        told(dearig("import", path, "--column", column, "--out", folder / "out.h5"))


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are less free elsewhere")
@examples(15, suite=5)
@given(text=st.text(alphabet=st.characters(exclude_characters="/\0"), min_size=1, max_size=40))
def test_names_of_files(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    raw = os.fsencode(text.encode("utf-8", "surrogateescape")[:80])
    folder = tmp_path_factory.mktemp("names")
    try:
        inner = Path(os.fsdecode(os.fsencode(str(folder)) + b"/d" + raw))
    except UnicodeError:
        return
    inner.mkdir()
    write_run(folder / "run.h5")
    name = inner / "run.h5"
    name.write_bytes((folder / "run.h5").read_bytes())
    for command in (
        ["info", name], ["info", inner], ["index", folder], ["record", inner, "--out", name],
        ["export", name, "--to", "csv", "--out", inner / "run.csv"],
        ["recover", name], ["import", name, "--out", folder / "out.h5"],
    ):  # fmt: skip
        told(dearig(*command))


def test_a_hostile_text_is_shown_as_what_it_is(tmp_path: Path) -> None:
    text = HOSTILE.encode("utf-8", "replace").decode("utf-8")
    shown = told(done("info", titled(tmp_path / "run.h5", text))).replace("\n", "").replace(" ", "")
    assert r"\x1b]0;owned\x07\x1b[2J\x9b31m\x7f\u202egnp.\u2066" in shown
    assert "[boldred]x[/]:smile:" in shown


def test_messages_of_the_log_and_of_errors_are_one_line_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DEARIG_LOG_DIR", str(tmp_path / "log"))
    answer = dearig("info", "no\x1b[2J\n2026-01-01 INFO all is well.h5")
    assert answer.code == 2
    assert answer.err.count("\n") == 1
    assert r"no\x1b[2J\n2026-01-01" in answer.err
    log = (tmp_path / "log" / "dearig.log").read_text(encoding="utf-8")
    assert printable(log, "\n") == log
    assert not any(line.startswith("2026-01-01 INFO") for line in log.splitlines())


def test_words_of_libraries_are_cleaned_too(tmp_path: Path) -> None:
    """What a plug-in prints, and its errors, go past every console."""
    code = (
        "import sys; sys.argv = ['dearig', 'presets']; from dearig.cli import tools, main; "
        "tools.write_result = lambda *_: (print('b\\x1b[2J'), sys.stderr.write('c\\x9b'), "
        "1 / [][:'\\x1b[2J'])\n"
        "main.main()"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, check=False, text=True,
        env={**os.environ, "DEARIG_LOG_DIR": str(tmp_path)},
    )  # fmt: skip
    assert r"b\x1b[2J" in ended.stdout
    assert r"c\x9b" in ended.stderr
    assert "unexpected error" in ended.stderr
    assert printable(ended.stdout + ended.stderr, "\n\t") == ended.stdout + ended.stderr


def test_a_progress_bar_shows_stages_as_text() -> None:
    import io

    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    screen = Terminal()
    console = PrintableConsole(file=screen)
    console._force_terminal = True
    with progress("dearig", console=console) as report:
        report("fit of \x1b]0;owned\x07[red]x", 0.5)
    assert "\x1b]0;owned" not in screen.getvalue()
    assert "\x07" not in screen.getvalue()
    assert r"\x1b]0;owned\x07[red]x" in screen.getvalue()


def test_a_report_shows_names_as_text(tmp_path: Path) -> None:
    """Neither HTML nor the mathematics of matplotlib."""
    model = thesis_model(tmp_path / "model.toml")
    run = tmp_path / "<img src=x onerror=alert(1)> $\\frac{$ &amp; \x1b[2J.h5"
    sequence = write(tmp_path / "s.toml", LOBE.replace("one lobe", "<script>a $\\\\x_{$"))
    done("record", sequence, "--rig", "sim", "--out", run, "--notes", "<b>bold</b>")
    report = tmp_path / "report.html"
    told(done("validate", model, run, "--report", report))
    page = report.read_text(encoding="utf-8")
    assert "<img src=x" not in page
    assert "<script>a" not in page
    assert "&lt;img src=x" in page
