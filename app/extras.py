"""Packages that only an extra of the distribution installs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from dearig.errors import InputError

__all__ = ["import_extra"]


def import_extra(module: str, extra: str, purpose: str) -> Any:
    """Return the ``module``, which the extra ``extra`` of the distribution installs.

    ``purpose`` begins the sentence of the ``InputError`` that is raised where it is missing.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if (error.name or "").partition(".")[0] != package:
            raise
        raise InputError(
            f"{purpose} takes the Python package {package}, which is not installed: "
            f'pip install "dearig[{extra}]"'
        ) from error
