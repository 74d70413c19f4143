"""Hostile input: refused in words, at once, at no more memory than a small multiple of its size."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from dearig.printable import printable
from tests.deep import mostly_deep
from tests.security.cases import CASES, INPUTS, SPECIAL_FILES
from tests.security.cost import Cost, Measured, measuring
from tests.tools.command import LOBE, thesis_model
from tests.tools.recordings import write_run

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as on Linux"),
    pytest.mark.timeout(600),
]

#: Bytes that a command may take besides its input: what a simulated run, libraries that it loads
#: and their compiled code take.
BASE = 250_000_000
#: Bytes that a command may take for each byte of its input.
FACTOR = 100


@pytest.fixture(scope="module")
def measured() -> Iterator[Measured]:
    with measuring() as runner:
        yield runner


@pytest.fixture
def short() -> Iterator[Path]:
    """A folder with a short name: it is part of messages that are cut."""
    with tempfile.TemporaryDirectory(prefix="h") as made:
        yield Path(made)


def answered(cost: Cost, code: int | None, *words: str) -> None:
    """Check that a command ended by itself, with ``code`` and in words."""
    told = cost.err.decode("utf-8")
    assert cost.code >= 0, f"ended by signal {-cost.code}"
    assert cost.code in ((0, 2, 3, 4) if code is None else (code,)), (cost.code, told)
    for foreign in ("Traceback", "Warning:", "unexpected error"):
        assert foreign not in told
    if cost.code == 2:
        assert told.startswith("dearig: ")
        assert told.count("\n") == 1
    assert len(told) < 6000
    assert all(word in told for word in words), (words, told)
    for stream in (cost.out, cost.err):
        text = stream.decode("utf-8")
        assert printable(text, "\n\t") == text


#: Others of the same kinds, or dear ones, of which the suite has another.
DEEP = {
    "1,000,000 segments", "10,000 wrong segments", "30,000 segments", "200,000 tones",
    "2 MB of words", "2 MB of dots", "2 MB of digits", "2 MB of spaces", "2 MB of comments",
    "quoted parts", "spaced parts", "number with underscores", "a name of 50 MB",
    "checked, instruments by the thousand", "JSON of 1,000,000 arrays",
    "JSON of 1,000,000 objects", "80,000 channels", "100,000 tables", "2 MB of line ends",
    "2 MB of quotation marks", "200,000 levels", "a key of 1 MB", "a kind of 1 MB",
    "900 brackets", "a header of 100,000 parts", "tables in tables", "10,000 effects",
    "CSV of line ends", "CSV of quotation marks", "rig file of 50 MB", "10,000 segments",
    "JSON of 1,000,000 names", "CSV of 10,000,000 lines of names", "CSV of 1e400", "port of 1 MB",
    "instruments by the thousand", "fraction of 1 MB", "an effect of 100,000 values",
    "100,000 keys", "a table of 100,000 tables", "CSV with a wrong last line",
    "MAT that unpacks to 2 GB", "thesis of 100,000 lobes", "100,000 tables in one line",
    "dataset that unpacks to 16 GB", "title of 50 MB", "10,000 branches", "history of 9,000 tables",
}  # fmt: skip


@pytest.mark.parametrize("name", mostly_deep(CASES, CASES.keys() - DEEP))
def test_it_costs_little_and_is_answered_in_words(
    measured: Measured, short: Path, name: str
) -> None:
    case = CASES[name]
    argv = case.make(short)
    size = sum(path.stat().st_size for path in short.rglob("*") if path.is_file())
    cost = measured.run(argv)
    answered(cost, case.code, *case.words)
    assert cost.bytes <= BASE + FACTOR * size


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("good")
    write_run(folder / "run.h5")
    thesis_model(folder / "model.toml")
    (folder / "sequence.toml").write_text(LOBE, encoding="utf-8")
    return {path.stem: str(path) for path in folder.iterdir()}


#: Every kind at a sixth of the inputs, which change from kind to kind, and at all of them.
SIXTHS = [pytest.param(kind, i % 6, 6, id=kind) for i, kind in enumerate(SPECIAL_FILES)]
WHOLE = [
    pytest.param(kind, 0, 1, id=f"{kind}, all", marks=pytest.mark.deep) for kind in SPECIAL_FILES
]


@pytest.mark.parametrize(("kind", "first", "step"), SIXTHS + WHOLE)
def test_what_is_no_file_is_refused_by_every_input_without_waiting(
    measured: Measured, short: Path, good: dict[str, str], kind: str, first: int, step: int
) -> None:
    it = str(SPECIAL_FILES[kind](short))
    before = sorted(short.iterdir())
    for given in list(INPUTS.values())[first::step]:
        places = {**good, "it": it, "out": str(short / "new")}
        cost = measured.run([word.format(**places) for word in given.split()])
        assert cost.code == 2, (given, cost)
        answered(cost, 2)
        assert sorted(short.iterdir()) == before, given


@pytest.mark.parametrize("place", ["/etc/hostname", "../secret.csv", "link.csv", "inside/../../x"])
def test_a_sequence_reads_only_files_of_its_own_folder(
    measured: Measured, short: Path, place: str
) -> None:
    (short / "secret.csv").write_text("time_s,voltage_kV\n0,0\n1,0\n", encoding="utf-8")
    own = short / "own"
    own.mkdir()
    (own / "link.csv").symlink_to(short / "secret.csv")
    text = f'name = "x"\n[[segment]]\nkind = "csv"\nfile = "{place}"\n'
    (own / "s.toml").write_text(text, encoding="utf-8")
    out = str(short / "out.h5")
    answered(
        measured.run(["record", str(own / "s.toml"), "--out", out]), 2, "out of the sequence's"
    )
    assert not Path(out).exists()


def test_a_link_to_a_file_of_the_same_folder_is_followed(measured: Measured, short: Path) -> None:
    (short / "wave.csv").write_text("time_s,voltage_kV\n0,0\n1,0\n", encoding="utf-8")
    (short / "link.csv").symlink_to("wave.csv")
    text = 'name = "x"\n[[segment]]\nkind = "csv"\nfile = "link.csv"\n'
    (short / "s.toml").write_text(text, encoding="utf-8")
    out = str(short / "out.h5")
    answered(measured.run(["record", str(short / "s.toml"), "--out", out]), 0)
