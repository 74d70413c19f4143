"""What has to hold of the files after the commands of a case, however they met."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from dearig.errors import InputError
from dearig.recording import open_recording, recover
from dearig.recording.content.layout import IDENTIFIER
from dearig.recording.content.text import text_of
from dearig.recording.json_file import write_json
from dearig.recording.reading.opening import opened
from dearig.recording.verify import verify
from tests.interleave.commands import Ended

__all__ = ["check"]

#: What is said of the file of a run that was killed before its samples.
BEFORE_SAMPLES = (
    "killed before its first sample",
    "ended before its first block",
    "is empty: its run or its program ended before it wrote anything",
)
#: Exit codes of commands that did their work or were refused, of a verification that failed, and
#: the commands that put another recording in the place of one.
ALLOWED, FAILED = (0, 2), 4
REPLACES = ("force", "import")


def check(folder: Path, ended: list[Ended], given: dict[str, int]) -> list[str]:
    """Return what is wrong: a sentence each.

    ``given`` are the samples of the recordings that were there before, by their file names.
    """
    return [
        *_outputs(folder, ended),
        *_recordings(folder, ended),
        *_given(folder, ended, given),
        *_others(folder, ended),
    ]


def _outputs(folder: Path, ended: list[Ended]) -> Iterator[str]:
    for one in ended:
        who = f"{one.command.kind} {one.command.name}"
        killed = one.code == -9
        if one.code == FAILED and any(words in one.said for words in BEFORE_SAMPLES):
            # true of a run that was killed before it had samples, or of one that has only begun
            if not _killed_run(ended, folder / one.command.name) and not _beginning(ended, one):
                yield f"{who}: {one.said[-300:]}"
            continue
        if one.code not in ALLOWED and not killed:
            yield f"{who} ended with {one.code}: {one.said[-300:]}"
        if "Traceback" in one.said or "unexpected" in one.said or "hung" in one.said:
            yield f"{who}: {one.said[-4000:]}"
        if "by now" in one.said or "damaged" in one.said or "WRONG" in one.said:
            yield f"{who} met a file that another command had harmed: {one.said[-300:]}"


def _recordings(folder: Path, ended: list[Ended]) -> Iterator[str]:
    due: dict[str, tuple[int, Ended]] = {}  # samples that each run has flushed
    for one in ended:
        for identifier, (samples, closed) in one.runs.items():
            due[identifier] = (samples, one)
            if one.code == 0 and not closed:
                yield f"{one.command.kind} {one.command.name} ended with 0 and was not closed"
    found: dict[str, Path] = {}
    for path in sorted(folder.glob("*.h5*")):
        if path.suffix == ".journal":
            continue
        identifier = _identifier(path)
        try:
            recover(path)
            result = verify(path)
            samples = open_recording(path).samples
        except InputError as error:
            # a run that was killed before its first flush of samples may leave such a file
            if (identifier in due and due[identifier][0]) or not _killed_run(ended, path):
                yield f"{path.name} cannot be read: {error}"
            continue
        found[identifier] = path
        if not result.sound:
            yield f"{path.name} is not sound: {result.faults}"
        if identifier in due and samples < due[identifier][0]:
            yield f"{path.name} has {samples} samples, and {due[identifier][0]} were flushed"
    for identifier, (samples, one) in due.items():
        if identifier not in found and not _replaced(one.command.name, one.ended, ended):
            yield f"{one.command.arguments}: its {samples} samples are gone"
    for path in folder.glob("*.journal"):
        yield f"{path.name} is left after a recovery"


def _given(folder: Path, ended: list[Ended], given: dict[str, int]) -> Iterator[str]:
    for name, samples in given.items():
        if _replaced(name, 0.0, ended):
            continue
        try:
            left = open_recording(folder / name).samples
        except InputError as error:
            yield f"{name}, which was there before, cannot be read: {error}"
            continue
        if left != samples:
            yield f"{name}, which was there before, had {samples} samples and has {left}"


def _identifier(path: Path) -> str:
    try:
        with opened(path) as file:
            return text_of(file["entry"][IDENTIFIER][()])
    except (InputError, OSError, KeyError, RuntimeError):
        return ""


def _killed_run(ended: list[Ended], path: Path) -> bool:
    name = path.name.removesuffix(".old")
    return any(
        one.code == -9 and one.command.name == name and one.command.kind in ("record", "force")
        for one in ended
    )


def _beginning(ended: list[Ended], during: Ended) -> bool:
    """Return whether a command that makes the file of ``during`` went on at the same time."""
    return any(
        one.command.kind in ("record", *REPLACES)
        and one.command.name == during.command.name
        and one.began < during.ended
        and one.ended > during.began
        for one in ended
    )


def _replaced(name: str, after: float, ended: list[Ended]) -> bool:
    """Return True if a command may have replaced the recording ``name`` after ``after`` s."""
    return any(
        one.ended > after
        and one.code != 2
        and "--force" in one.command.arguments
        and one.command.kind in REPLACES
        and one.command.name == name
        for one in ended
    )


def _others(folder: Path, ended: list[Ended]) -> Iterator[str]:
    table = folder / "out.csv"
    if table.exists():
        with table.open(encoding="utf-8", newline="") as stream:
            rows = list(csv.reader(stream))
        if len(rows) < 2 or {len(row) for row in rows} != {len(rows[0])}:
            yield f"{table.name} is damaged: {len(rows)} rows"
    elif any(one.command.kind == "export" and one.code == 0 for one in ended):
        yield "an export ended with 0 and its file is missing"
    # the next output removes what killed commands have left
    write_json({}, folder / "last.json")
    for path in folder.glob(".*"):
        yield f"{path.name} is left of an ended command"
