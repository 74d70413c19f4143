"""Texts of the program with the options and commands of the command line."""

from __future__ import annotations

import shlex
from collections.abc import Iterator

from dearig.errors import Hints, hints_of

__all__ = ["option_name", "with_hints"]

#: What is added to a text about these options, in place of their names in brackets.
_SUFFIXES = {
    "force": ", or use --force",
    "skip_bad_rows": "; --skip-bad-rows leaves such rows out",
}


def with_hints(text: str | BaseException) -> str:
    """Return a text, or what an error says, with the options and commands that it is about."""
    hints = hints_of(text)
    named = dict.fromkeys(name for hint in hints for name in _named(hint))
    suffixes = dict.fromkeys(
        _SUFFIXES[option] for hint in hints for option in hint.options if option in _SUFFIXES
    )
    brackets = f" ({', '.join(named)})" if named else ""
    return f"{text}{brackets}{''.join(suffixes)}"


def option_name(name: str) -> str:
    """Return the option for a value: ``--gauge-length-mm`` for ``gauge_length_mm``."""
    return f"--{name.replace('_', '-')}"


def _named(hint: Hints) -> Iterator[str]:
    options = [option_name(name) for name in hint.options if name not in _SUFFIXES]
    if hint.command:
        yield " ".join([shlex.join(["dearig", *hint.command]), *options])
    else:
        yield from options
