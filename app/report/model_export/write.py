"""Write a model for another program."""

from __future__ import annotations

from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from types import MappingProxyType

from dearig.config.modelfile import ModelFile
from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done
from dearig.report.model_export.latex import latex_page
from dearig.report.model_export.prony import prony_text
from dearig.report.model_export.python_file import python_file

__all__ = ["KINDS", "export_text", "write_export"]

#: What a model can be exported to, and the ending of the file.
KINDS = MappingProxyType({"latex": ".tex", "python": ".py", "prony": ".txt"})
_TEXTS: MappingProxyType[str, Callable[[ModelFile, str], str]] = MappingProxyType(
    {"latex": latex_page, "python": python_file, "prony": prony_text}
)


def export_text(given: ModelFile, to: str) -> str:
    """Return ``given`` for another program: ``to`` is latex, python or prony.

    Raises
    ------
    InputError
        For another ``to``.
    """
    if to not in _TEXTS:
        raise InputError(f"a model is exported to {', '.join(KINDS)}, not to {to!r}")
    return _TEXTS[to](given, metadata.version("dearig"))


def write_export(given: ModelFile, to: str, path: str | Path, overwrite: bool = False) -> Path:
    """Write ``export_text`` to ``path`` and return it. Raises ``InputError``."""
    text = export_text(given, to)
    target = check_output(path, overwrite)
    with replaced_when_done(target, overwrite) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")
    return target
