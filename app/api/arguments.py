"""Errors with the arguments of the called function that they are about."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import ParamSpec, TypeVar

import numpy as np

from dearig.errors import DearigError, InputError, hints_of

__all__ = ["named_arguments"]

#: What each annotation of an argument allows, as types and in words. Numbers may be NumPy's.
_KINDS: Mapping[str, tuple[type | tuple[type, ...], str]] = {
    "bool": ((bool, np.bool_), "True or False"),
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "str": (str, "a text"),
}

P = ParamSpec("P")
R = TypeVar("R")

#: Arguments in Python whose options have another name.
_ARGUMENTS = {"force": "overwrite", "out": "path"}


def named_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Return ``function`` whose errors name, in a note, the arguments that they are about.

    A traceback shows the note below the message. Arguments that are to be a number, a text or True
    or False are refused where they are not: a text "false" would count as True.
    """
    known = inspect.signature(function).parameters

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            for name, value in (*zip(known, args, strict=False), *kwargs.items()):
                if name in known:
                    _check_kind(name, value, str(known[name].annotation))
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


def _check_kind(name: str, value: object, wanted: str) -> None:
    """Raise ``InputError`` where ``value`` is not of the ``wanted`` annotation, of simple ones."""
    kinds, what = _KINDS.get(wanted, (object, ""))
    if not isinstance(value, kinds) or (wanted == "int" and isinstance(value, bool)):
        raise InputError(f"{name} = {value!r} is not {what}", option=name)
