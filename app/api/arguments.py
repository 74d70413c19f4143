"""Errors with the arguments of the called function that they are about."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from dearig.errors import DearigError, hints_of

__all__ = ["named_arguments"]

P = ParamSpec("P")
R = TypeVar("R")

#: Arguments in Python whose options have another name.
_ARGUMENTS = {"force": "overwrite", "out": "path"}


def named_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Return ``function`` whose errors name, in a note, the arguments that they are about.

    A traceback shows the note below the message.
    """
    known = inspect.signature(function).parameters

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except DearigError as error:
            options = (option for hint in hints_of(error) for option in hint.options)
            names = dict.fromkeys(
                name
                for option in options
                for name in (option, _ARGUMENTS.get(option, option))
                if name in known
            )
            if names:
                error.add_note(
                    f"see the argument{'s' if len(names) > 1 else ''} {', '.join(names)}"
                )
            raise

    return call
