"""The command ``dearig``: its groups of commands, its exit codes and its error messages.

Nothing heavy is imported here, so that ``dearig --help`` answers immediately: each command imports
what it needs when it runs.
"""

from __future__ import annotations

import errno
import io
import logging
import os
import platform
import re
import shlex
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, TextIO, cast

import typer
from typer.exceptions import TyperException

from dearig import log_file
from dearig.acquisition.interrupts import ends_program, ignore_interrupts, interrupted
from dearig.cli import campaign, files, fit, hold, run, study, tools, track, trends, watch
from dearig.cli.last_words import (
    LastingStream,
    leave,
    open_streams,
    output_failure,
    silence_libraries,
)
from dearig.cli.lost_interrupt import note_lost
from dearig.cli.output import with_hints
from dearig.command_line import without_secrets
from dearig.errors import DearigError, DiskFault, InputError, Interrupted
from dearig.printable import MESSAGE_MAX, PrintableStream, printable
from dearig.units import in_digits

__all__ = ["app", "main"]

log = logging.getLogger(__name__)

app = typer.Typer(
    name="dearig",
    help="Run a dielectric-elastomer actuator rig, record it, and find out what its physical "
    "model is missing.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _group in (run, track, hold, campaign, watch, files, fit, study, trends, tools):
    app.add_typer(_group.commands)


def _show_version(asked: bool) -> None:
    if asked:
        from dearig.revision import revision, version

        sys.stdout.write(f"dearig {revision().text(version())}\n")
        raise typer.Exit


@app.callback()
def _options(
    verbose: Annotated[
        int, typer.Option("--verbose", "-v", count=True, help="Show more messages; -vv shows all.")
    ] = 0,
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    root = logging.getLogger()
    for handler in root.handlers:
        if isinstance(handler, _Terminal):
            handler.show(verbose)
    if verbose > 1:
        root.setLevel(logging.DEBUG)
    log.info("started: %s", shlex.join(["dearig", *without_secrets(sys.argv[1:])]))


class _Terminal(logging.StreamHandler[TextIO]):
    """Log messages on standard error: warnings, and more with ``--verbose``."""

    def __init__(self) -> None:
        super().__init__(sys.stderr)
        self.setFormatter(log_file.PrintableFormatter("%(levelname)s: %(message)s"))
        self.show(0)

    def show(self, verbose: int) -> None:
        self.setLevel((logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)])

    def filter(self, record: logging.LogRecord) -> bool:
        # tracebacks, and Python's warnings of libraries, are for the log file
        reported = record.exc_info is None and record.name != "py.warnings"
        wanted = reported or self.level < logging.WARNING
        return wanted and bool(super().filter(record))


def main() -> None:
    """Run the command line; errors become one sentence and an exit code."""
    open_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # characters that the terminal's encoding lacks are escaped; they raise nothing
            stream.reconfigure(errors="backslashreplace")
    silence_libraries()
    _give_matplotlib_a_folder()
    # numba's colours, by colorama, would write an escape sequence behind the last line
    os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
    with (
        _printable_output(), log_file.attached() as written, _terminal(),
        _unexpected_errors_logged(written), _library_warnings_logged(),
    ):  # fmt: skip
        ends_program()
        try:
            status = _run(written)
        except KeyboardInterrupt:  # pressed again while the first one was answered
            status = _interrupted()
        _await_notifications()
        if written.stream is not None:  # a command has started, not only --help
            log.info("ended with exit code %d", status)
    leave(status)


def _await_notifications() -> None:
    """Wait until notifications are delivered, within their time limits."""
    notify = sys.modules.get("dearig.batch.notify")
    if notify is not None:
        notify.await_notifications()


@contextmanager
def _library_warnings_logged() -> Iterator[None]:
    """Write warnings of libraries to the log; on the terminal they do not help an operator."""
    shown = warnings.showwarning

    def to_log(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,  # noqa: ARG001
        line: str | None = None,  # noqa: ARG001
    ) -> None:
        log.info("%s at %s:%d: %s", category.__name__, filename, lineno, message)

    warnings.showwarning = to_log
    try:
        yield
    finally:
        warnings.showwarning = shown


@contextmanager
def _printable_output() -> Iterator[None]:
    """Let only printable characters through to the terminal, also those of other packages."""
    raw = sys.stdout, sys.stderr
    lasting = LastingStream(raw[0]), LastingStream(raw[1], ends_run=True)
    sys.stdout, sys.stderr = (cast(TextIO, PrintableStream(cast(TextIO, s))) for s in lasting)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = raw


def _give_matplotlib_a_folder() -> None:
    """Set ``MPLCONFIGDIR`` where matplotlib's own folders cannot be used or trusted.

    It would make a new folder in every process, and warn of it.
    """
    import platformdirs

    from dearig.model.compiled.trusted_folder import cache_root, usable

    asked = os.environ.get("MPLCONFIGDIR")
    usual = (platformdirs.user_config_dir(), platformdirs.user_cache_dir())
    if os.name == "nt" or all(usable(Path(f))[0] for f in ([asked] if asked else usual)):
        return
    root = cache_root().path
    if root is not None:
        os.environ["MPLCONFIGDIR"] = str(root / "matplotlib")


@contextmanager
def _terminal() -> Iterator[None]:
    handler = _Terminal()
    # messages of other packages do not help an operator
    for name in ("numba", "matplotlib"):
        logging.getLogger(name).setLevel(logging.WARNING)
    logging.getLogger().addHandler(handler)
    logging.captureWarnings(capture=True)
    try:
        yield
    finally:
        logging.captureWarnings(capture=False)
        logging.getLogger().removeHandler(handler)


def _run(written: log_file.LogFile) -> int:
    """Run the command and return its exit code."""
    try:
        status: object = app(prog_name="dearig", standalone_mode=False)
        if status == Interrupted.exit_code:  # typer returns it for a KeyboardInterrupt
            return _interrupted()
        sys.stdout.flush()
    except DearigError as error:
        ignore_interrupts()
        _say(with_hints(error))
        return error.exit_code
    except TyperException as error:
        _say(_usage(error))
        return InputError.exit_code
    except KeyboardInterrupt:
        return _interrupted()
    except Exception as error:
        if interrupted():
            # such as by a library whose import was broken off
            log.info("interrupted", exc_info=True)
            return _interrupted()
        exhausted = _exhausted(error)
        if exhausted:
            log.exception(exhausted)
            _say(exhausted)
            return DiskFault.exit_code
        _tell_unexpected(error, written)
        return DearigError.exit_code
    failure = output_failure()
    # the reader of a pipe (head, less) that has seen enough is not an error
    if status or failure is None or isinstance(failure, BrokenPipeError):
        return status if isinstance(status, int) else 0
    _say(_exhausted(failure) or f"standard output could not be written ({failure.strerror})")
    return DiskFault.exit_code


#: Words of the system's loader of libraries, and of Python's threads, without memory.
_NO_ROOM = re.compile(
    r"failed to map segment|cannot allocate memory|can't start new thread", re.IGNORECASE
)
#: Errors of a system whose disk is full, over its quota or broken.
_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


def _exhausted(error: Exception) -> str:
    """Return a sentence if ``error`` is the computer's lack of memory or disk; else nothing.

    Errors of a disk reach this only from standard output and from temporary files: what writes
    results has a sentence of its own.
    """
    without_memory = _nameless(error) or _misread(error) or _unallocated(error) or _unloaded(error)
    if isinstance(error, MemoryError) or without_memory:
        return (
            "the computer has no memory left; close other programs, or give this command less at a "
            "time; files that it had finished are whole"
        )
    if isinstance(error, OSError) and error.errno in _DISK_ERRORS:
        return (
            f"standard output or a temporary file could not be written ({os.strerror(error.errno)})"
            f"; free some space; files that the command had finished are whole"
        )
    return ""


def _nameless(error: Exception) -> bool:
    """Return True if native code failed without an error: no memory for the error itself."""
    said = str(error)
    return isinstance(error, SystemError) and (
        "without exception set" in said or "without setting an exception" in said
    )


def _unallocated(error: Exception) -> bool:
    """Return True if HDF5 had no memory: it says so in the words of another error."""
    said = str(error)
    return "unable to allocate" in said or "memory allocation failed" in said


def _unloaded(error: BaseException) -> bool:
    """Return True if a library or a thread had no room in the memory: a library may wrap this."""
    seen: list[BaseException] = []
    while error not in seen:
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:
            return True
        if isinstance(error, ImportError | OSError | RuntimeError) and _NO_ROOM.search(str(error)):
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__ or error
    return False


def _misread(error: Exception) -> bool:
    """Return True if Python refused a source that is right: its parser had no memory."""
    if not isinstance(error, SyntaxError) or not error.filename:
        return False
    if error.filename == "<string>":
        return True  # a program wrote it, and the same one in every run
    try:
        compile(Path(error.filename).read_bytes(), error.filename, "exec")
    except (OSError, SyntaxError, ValueError):
        return False
    return True


def _interrupted() -> int:
    """Say that the command was interrupted outside a run, and return its exit code."""
    ignore_interrupts()
    _say("interrupted")
    return Interrupted.exit_code


#: Wording of the libraries that read the command line, and what an operator reads instead.
_REWORDED = (
    (r"Value error, ", ""),
    (r": Input should be ", ": it must be "),
    (r"it must be a valid integer, unable .*", "it must be a whole number"),
    (r"it must be a valid number, unable .*", "it must be a number"),
    (r"it must be greater than or equal to ", "it must be at least "),
    (r"it must be less than or equal to ", "it must be at most "),
    (r"No such option: -\d.*", "a value below 0 stands after two dashes, as in -- -0.5"),
    (r"Got unexpected extra argument\(?s?\)? \((.*)\)", r"too many arguments, from \1 on"),
)


def _usage(error: TyperException) -> str:
    """Return Typer's complaint about the command line as a sentence."""
    context = getattr(error, "ctx", None)
    # an option without its value is reported without the command that it belongs to
    command = sys.argv[1] if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else ""
    path = f"dearig {command}".strip() if context is None else context.command_path
    words = error.format_message().strip().rstrip(".")
    for theirs, ours in _REWORDED:
        words = re.sub(theirs, ours, words)
    return f"{words}; {path} --help shows what it takes" if words else f"try {path} --help"


def _say(message: str) -> None:
    log.info("message: %s", message)
    sys.stderr.write(f"dearig: {printable(in_digits(message), most=MESSAGE_MAX)}\n")


# ---------------------------------------------------------------- unexpected errors


def _tell_unexpected(error: BaseException, written: log_file.LogFile) -> None:
    """Log ``error`` with its traceback, and say in one sentence where that is."""
    from dearig.revision import version

    log.error(
        "unexpected error in dearig %s, Python %s, %s",
        version(), platform.python_version(), platform.platform(),
        exc_info=(type(error), error, error.__traceback__),
    )  # fmt: skip
    what = " ".join(f"{type(error).__name__}: {error}".split())
    if written.problem is None:
        where = f"the details are in {written.baseFilename}; send that file with a report of this"
    else:
        where = (
            f"the log file {written.baseFilename} cannot be written ({written.problem}); "
            f"dearig -v shows the details"
        )
    what = printable(what, most=MESSAGE_MAX)
    sys.stderr.write(f"dearig: unexpected error, a mistake in this program ({what}); {where}\n")


@contextmanager
def _unexpected_errors_logged(written: log_file.LogFile) -> Iterator[None]:
    """Tell errors in threads and in Qt's slots too, which no ``except`` reaches."""
    before = sys.excepthook, threading.excepthook, sys.unraisablehook

    def thread_ended(args: threading.ExceptHookArgs) -> None:
        if args.exc_value is not None:
            _tell_unexpected(args.exc_value, written)

    sys.excepthook = lambda _, error, __: _tell_unexpected(error, written)
    threading.excepthook = thread_ended

    def unraisable(args: Any) -> None:
        if isinstance(args.exc_value, KeyboardInterrupt):
            note_lost()
            return
        if isinstance(args.exc_value, Exception) and _exhausted(args.exc_value):
            log.warning("an object could not be deleted: %s", args.exc_value)
            return
        # such as a library's object that cannot let go of an instrument whose link is lost
        log.error("error while an object was deleted: %r", args.object, exc_info=args.exc_value)

    sys.unraisablehook = unraisable
    try:
        yield
    finally:
        sys.excepthook, threading.excepthook, sys.unraisablehook = before


if __name__ == "__main__":
    main()
