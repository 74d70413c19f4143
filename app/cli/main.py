"""The command ``dearig``: its groups of commands, its exit codes and its error messages.

Nothing heavy is imported here, so that ``dearig --help`` answers at once: each command imports
what it needs when it runs.
"""

from __future__ import annotations

import io
import logging
import os
import re
import sys
from typing import Annotated

import typer
from typer.exceptions import TyperException

from dearig.cli import files, fit, run, tools
from dearig.errors import DearigError, InputError

__all__ = ["app", "main"]

app = typer.Typer(
    name="dearig",
    help="Run a dielectric-elastomer actuator rig, record it, and find out what its physical "
    "model is missing.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _group in (run, files, fit, tools):
    app.add_typer(_group.commands)


@app.callback()
def _options(
    verbose: Annotated[
        int, typer.Option("--verbose", "-v", count=True, help="Show more messages; -vv shows all.")
    ] = 0,
) -> None:
    level = (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    logging.basicConfig(level=level, format="%(levelname)s: %(message)s", stream=sys.stderr)
    # messages of other packages do not help an operator
    logging.getLogger("numba").setLevel(logging.WARNING)
    logging.getLogger("matplotlib").setLevel(logging.WARNING)


def main() -> None:
    """Run the command line; errors become one sentence and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # characters that the terminal's encoding lacks are escaped; they raise nothing
            stream.reconfigure(errors="backslashreplace")
    try:
        status: object = app(prog_name="dearig", standalone_mode=False)
        if status == _INTERRUPTED:  # typer returns it for a KeyboardInterrupt
            _say("interrupted")
        sys.stdout.flush()
    except DearigError as error:
        if isinstance(error.__cause__, BrokenPipeError):
            status = _reader_left()
        else:
            _say(str(error))
            status = error.exit_code
    except TyperException as error:
        _say(_usage(error))
        status = InputError.exit_code
    except KeyboardInterrupt:
        _say("interrupted")
        status = _INTERRUPTED
    except (BrokenPipeError, SystemExit):
        # rich and typer both turn a broken pipe into a SystemExit; nothing else here raises one
        status = _reader_left()
    sys.exit(status if isinstance(status, int) else 0)


_INTERRUPTED = 130


def _reader_left() -> int:
    """Discard further output after the reader of a pipe (head, less) has ended: no error."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _usage(error: TyperException) -> str:
    """Return Typer's complaint about the command line as a sentence."""
    context = getattr(error, "ctx", None)
    command = "dearig" if context is None else context.command_path
    # wording of the library that checks the values
    words = error.format_message().replace("Value error, ", "").strip().rstrip(".")
    words = re.sub(r"(.*): Input should be ", r"\1: it must be ", words)
    return f"{words}; {command} --help shows what it takes" if words else f"try {command} --help"


def _say(message: str) -> None:
    sys.stderr.write(f"dearig: {message}\n")


if __name__ == "__main__":
    main()
