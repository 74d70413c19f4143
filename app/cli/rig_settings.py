"""Rig file of a run: read, and said before a rig that is not simulated is armed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from dearig.cli.output import print_line

if TYPE_CHECKING:
    from rich.console import Console

    from dearig.config.rigfile import RigFile

__all__ = ["announce_rig", "rig_settings"]


def rig_settings(path: Path | None) -> tuple[RigFile, str, dict[str, str]]:
    """Return settings and text of the rig file at ``path``, and what a recording says of it."""
    from dearig.acquisition.rig_source import SOURCE, source_of
    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text

    text = "" if path is None else read_text(path, "rig file")
    return load_rig_file(path), text, {SOURCE: source_of(path)}


def announce_rig(
    console: Console,
    rig: str,
    settings: RigFile,
    source: str,
    differing: Iterable[str] = (),
    simulated: bool | None = None,
) -> None:
    """Print watchdog, scaling and limits of runs on a ``rig`` that is not simulated.

    ``differing`` are sentences on what differs from them elsewhere, such as in a recording;
    ``simulated`` is what the card reports of itself, None before it was asked. Raises
    ``InputError`` for a rig that is not known.
    """
    from dearig.acquisition.rig_source import in_force
    from dearig.acquisition.rigs import kind_of
    from dearig.drivers.daqmx.watchdog import watchdog_text

    if kind_of(rig).simulated:
        return
    if rig.startswith("daqmx:"):
        print_line(console, f"hardware watchdog: {watchdog_text(settings.card, simulated)}")
    print_line(console, in_force(settings, source))
    for sentence in differing:
        print_line(console, sentence, "yellow")
