"""What every command does with its output files and its terminal."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dearig.errors import DearigError, Hints, InputError, Remedy, hints_of
from dearig.printable import MESSAGE_MAX, printable

if TYPE_CHECKING:
    from rich.console import Console

    from dearig.progress import Progress
    from dearig.recording.reading.recording import Recording

__all__ = [
    "announce_compilation",
    "check_files",
    "console_for",
    "open_recordings",
    "option_name",
    "optional",
    "print_line",
    "print_lines",
    "with_hints",
    "working",
    "write_result",
]


def optional(path: Path | None) -> list[Path]:
    """Return ``path`` in a list, or an empty list where it is None."""
    return [] if path is None else [path]


def check_files(
    force: bool,
    sources: Iterable[str | Path | None],
    *outputs: Path,
    json: str | None,
    recording: Path | None = None,
) -> None:
    """Raise ``InputError`` for an output that cannot be written, before any work is done.

    ``sources`` are the files that are read; they are never overwritten, even with ``force`` (the
    name of a preset is not a file and does no harm here). ``recording`` is the output that will be
    a recording.
    """
    from dearig.recording.files import check_output, check_recording_name

    read = [source for source in sources if source is not None]
    written = [*outputs, *([] if json in (None, "-") else [Path(str(json))])]
    for i, path in enumerate(written):
        check_output(path, force, *read)
        if any(os.path.realpath(path) == os.path.realpath(other) for other in written[:i]):
            raise InputError(f"{path} is named for two outputs; give each output its own name")
    if recording is not None:
        check_recording_name(recording)


def console_for(json: str | None = None) -> Console:
    """Return the console for text: standard error while JSON goes to standard output."""
    from dearig.cli.console import PrintableConsole

    return PrintableConsole(stderr=json == "-")


#: What is added to a text about these options, in place of their names in brackets.
_SUFFIXES = {
    "force": ", or use --force",
    "skip_bad_rows": "; --skip-bad-rows leaves such rows or readings out",
}


def with_hints(text: str | BaseException) -> str:
    """Return a text, or what an error says, with the options and commands that it is about."""
    hints = hints_of(text)
    remedy = text.remedy if isinstance(text, DearigError) else None
    shown = {option_name(name) for name, _ in remedy.values} if remedy else set()
    named = dict.fromkeys(name for hint in hints for name in _named(hint) if name not in shown)
    suffixes = dict.fromkeys(
        _SUFFIXES[option] for hint in hints for option in hint.options if option in _SUFFIXES
    )
    brackets = f" ({', '.join(named)})" if named else ""
    return f"{text}{brackets}{''.join(suffixes)}{_run(remedy) if remedy else ''}"


def option_name(name: str) -> str:
    """Return the option for a value: ``--gauge-length-mm`` for ``gauge_length_mm``."""
    return f"--{name.replace('_', '-')}"


def _run(remedy: Remedy) -> str:
    """Return the end of a text: the command to run, and what must be done before."""
    words = ["dearig", *remedy.command]
    for name, value in remedy.values:
        words.append(option_name(name))
        if value is not True:
            words.append(f"{value:g}" if isinstance(value, float) else str(value))
    before = "; run"
    if remedy.holes:
        before = f". Put what is right for {' and '.join(remedy.holes)}, and run"
    elif remedy.is_guess:
        before = ". If this is right, or after correcting it, run"
    return f"{before}: {shlex.join(words)}"


def _named(hint: Hints) -> Iterator[str]:
    options = [option_name(name) for name in hint.options if name not in _SUFFIXES]
    if hint.command:
        yield " ".join([shlex.join(["dearig", *hint.command]), *options])
    else:
        yield from options


def print_line(console: Console, text: str, style: str | None = None) -> None:
    r"""Print ``text`` as one line, which is not wrapped: an end of line in it shows as ``\n``."""
    print_lines(console, [text], style)


def print_lines(console: Console, texts: Iterable[str], style: str | None = None) -> None:
    """Print each of ``texts`` as one line."""
    # at once: rich takes a tenth of a millisecond for each call, and there may be 10,000 lines
    text = "\n".join(printable(text, most=MESSAGE_MAX) for text in texts)
    console.print(text, style=style, markup=False, highlight=False, emoji=False, soft_wrap=True)


def open_recordings(
    console: Console, train: Sequence[Path], validation: Sequence[Path], ended_early: str
) -> tuple[list[Recording], list[Recording]]:
    """Return the recordings at ``train`` and ``validation``; warn of runs that ended early.

    The warning comes before they are used as they are.
    """
    from dearig.analysis.readings.early_ends import early_end_warnings
    from dearig.recording.reading.reader import open_recording

    opened = {path: open_recording(path) for path in (*train, *validation)}
    found = early_end_warnings([*opened.values()]) if ended_early == "keep" else ()
    if found:
        print_lines(console, [f"Warning: {said}" for said in found], "yellow")
        print_line(
            console,
            "Use --ended-early cut to leave out such an end, or --ended-early leave-out to leave "
            "out the recording.",
        )
    return [opened[path] for path in train], [opened[path] for path in validation]


@contextmanager
def working(
    json: str | None, computes: bool = True, whole: bool = False
) -> Iterator[tuple[Console, Progress]]:
    """Give a console for results, and show a progress bar on standard error while the body works.

    ``computes``: the body uses the compiled kernels. ``whole``: its fractions are of all its work,
    not of one stage.
    """
    from dearig.cli.progress_bar import progress

    if computes:
        announce_compilation()
    with progress("dearig", whole=whole, computes=computes) as report:
        yield console_for(json), report


def write_result(result: dict[str, Any] | Callable[[], dict[str, Any]], json: str | None) -> None:
    """Write ``result``, or what it returns, to where ``--json`` says, if it was given."""
    if json is not None:
        from dearig.recording.json_file import write_json

        write_json(result() if callable(result) else result, json)


def announce_compilation() -> None:
    """Say on standard error that the kernels are compiled first, unless they are."""
    from dearig.model.compiled.jit import cache_folder, cache_note, is_compiled

    folder, note = cache_folder(), cache_note()
    if folder is None:
        sys.stderr.write(
            f"Compiling the numerical kernels: this takes about two minutes with every command, as "
            f"there is no folder to keep them in ({note}); set NUMBA_CACHE_DIR to one.\n"
        )
        return
    if note:
        sys.stderr.write(f"The compiled kernels are kept in {folder}: {note}.\n")
    if not is_compiled():
        sys.stderr.write("Compiling the numerical kernels, once: this takes about two minutes.\n")
