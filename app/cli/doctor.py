"""What ``dearig doctor`` finds out: what is installed, where files go, and what is missing.

Nothing here may fail because something else is broken, so each look-up is made separately and its
failure is one more item of the list.
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from dearig import log_file
from dearig.printable import printable
from dearig.revision import revision, version

if TYPE_CHECKING:
    from packaging.requirements import Requirement
    from rich.console import RenderableType

__all__ = ["Item", "doctor_json", "doctor_table", "examine"]

#: Groups of entry points through which other distributions extend this one.
PLUGIN_GROUPS = ("segments", "importers", "exporters", "effects", "rigs", "instruments")

#: Extras for work on the program itself.
_FOR_DEVELOPERS = ("test", "docs")

Verdict = Literal["ok", "missing", "wrong"]


@dataclass(frozen=True)
class Item:
    """One thing that was looked up.

    ``verdict`` is "missing" for what only some commands need, "wrong" for what has to be corrected.
    ``advice`` says what to do about either.
    """

    section: str
    name: str
    found: str
    verdict: Verdict = "ok"
    advice: str = ""


def examine() -> tuple[Item, ...]:
    """Return everything that was found out, section by section."""
    sections: dict[str, Callable[[], Iterator[Item]]] = {
        "programs": _programs,
        "packages": _packages,
        "extras": _extras,
        "folders": _folders,
        "kernels": _kernels,
        "card": _card,
        "window": _window,
        "plug-ins": _plugins,
    }
    return tuple(item for name, look in sections.items() for item in _guarded(name, look))


def _guarded(section: str, look: Callable[[], Iterator[Item]]) -> Iterator[Item]:
    try:
        yield from look()
    except Exception as error:  # noqa: BLE001  (whatever is broken is what a doctor has to tell)
        yield Item(
            section, section, f"cannot be determined: {type(error).__name__}: {error}", "wrong",
            "install dearig again with: pip install --force-reinstall dearig",
        )  # fmt: skip


# ---------------------------------------------------------------- versions


def _programs() -> Iterator[Item]:
    yield Item("programs", "dearig", revision().text(version()))
    yield Item("programs", "Python", f"{platform.python_version()} at {sys.executable}")
    yield Item("programs", "system", platform.platform())


def _required(extra: str = "") -> dict[str, Requirement]:
    """Return what the distribution, or one of its extras, asks for on this Python, by name."""
    from packaging.requirements import Requirement

    found: dict[str, Requirement] = {}
    for line in metadata.requires("dearig") or ():
        requirement = Requirement(line)
        always = requirement.marker is None or requirement.marker.evaluate({"extra": ""})
        if extra and (always or not _holds(requirement, extra)):
            continue
        # an extra that is made of other extras names the distribution itself
        if (extra or always) and requirement.name != "dearig":
            found[requirement.name] = requirement
    return dict(sorted(found.items(), key=lambda pair: pair[0].lower()))


def _holds(requirement: Requirement, extra: str) -> bool:
    return requirement.marker is not None and requirement.marker.evaluate({"extra": extra})


def _lacking(requirement: Requirement) -> str:
    """Return why ``requirement`` is not met; "" where it is."""
    try:
        found = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return f"{requirement.name} is not installed"
    if requirement.specifier.contains(found, prereleases=True):
        return ""
    return f"{requirement.name} is {found}, and {requirement.specifier} is needed"


def _packages() -> Iterator[Item]:
    for name, requirement in _required().items():
        lacking = _lacking(requirement)
        if lacking:
            yield Item(
                "packages", name, lacking, "wrong", f'pip install "{name}{requirement.specifier}"'
            )
        else:
            yield Item("packages", name, metadata.version(name))


def _extras() -> Iterator[Item]:
    for extra in metadata.metadata("dearig").get_all("Provides-Extra") or ():
        wanted = _required(extra)
        if extra in _FOR_DEVELOPERS or not wanted:
            continue
        lacking = [why for why in map(_lacking, wanted.values()) if why]
        if lacking:
            yield Item(
                "extras", extra, ", ".join(lacking), "missing", f'pip install "dearig[{extra}]"'
            )
        else:
            versions = ", ".join(f"{name} {metadata.version(name)}" for name in wanted)
            yield Item("extras", extra, versions)


# ---------------------------------------------------------------- files


def _folders() -> Iterator[Item]:
    from dearig.drivers.settings import CardSettings
    from dearig.model.compiled.trusted_folder import cache_root
    from dearig.recording.writing.disk_space import estimate_bytes

    yield _folder("log", log_file.log_path().parent)
    cache = cache_root()
    yield _cache("cache", cache.path, cache.note)
    yield _folder("current folder", Path.cwd())
    rate = CardSettings().sample_rate_Hz
    hour = estimate_bytes(4, rate, round(3600 * rate))
    free = shutil.disk_usage(Path.cwd()).free
    enough = free > hour
    yield Item(
        "folders", "disk",
        f"{free / 1e9:.3g} GB free here; an hour of recording at {rate:g} Hz takes "
        f"{hour / 1e9:.2g} GB",
        "ok" if enough else "wrong",
        "" if enough else "make room, or record to another disk",
    )  # fmt: skip


def _folder(name: str, folder: Path) -> Item:
    nearest = folder
    while not nearest.exists() and nearest != nearest.parent:
        nearest = nearest.parent
    if nearest.is_dir() and os.access(nearest, os.W_OK):
        return Item("folders", name, f"{folder}{'' if folder.exists() else ' (not made yet)'}")
    owner = _owner(nearest)
    whose = f" (it belongs to {owner})" if owner else ""
    return Item(
        "folders", name, f"{folder} cannot be written{whose}", "wrong",
        "allow this user to write there",
    )  # fmt: skip


def _cache(name: str, folder: Path | None, note: str, found: str = "") -> Item:
    """Return the item of a cache: its folder, and why that is not the usual one."""
    section = "kernels" if found else "folders"
    if folder is None:
        return Item(
            section, name, f"none, so every command is slower: {note}", "wrong",
            "set XDG_CACHE_HOME or NUMBA_CACHE_DIR to a folder that only this user can write"
            if os.name != "nt" else "allow this user to write there",
        )  # fmt: skip
    text = found or str(folder)
    if note:
        advice = "correct its owner and mode (chmod go-w), or name another folder"
        return Item(section, name, f"{text} instead of the usual folder: {note}", "wrong", advice)
    return Item(section, name, text)


def _owner(path: Path) -> str:
    """Return the user who owns ``path``; "" on systems that do not say."""
    try:
        return path.owner()
    except (OSError, KeyError, NotImplementedError):  # Windows; a user without a name
        return ""


def _kernels() -> Iterator[Item]:
    from dearig.model.compiled.jit import cache_folder, cache_note, is_compiled

    folder = cache_folder()
    owner = _owner(folder) if folder else ""
    where = f"{folder}{f', owned by {owner}' if owner else ''}"
    if not is_compiled():
        where = f"none yet in {where}; the first command compiles them"
    yield _cache("compiled kernels", folder, cache_note(), where)


# ---------------------------------------------------------------- instruments and window


def _card() -> Iterator[Item]:
    from dearig.drivers.daqmx.installed import installed

    only = "only a card in this computer needs it; a simulated rig or a card behind a server do not"
    try:
        found = installed()
    except ModuleNotFoundError as error:
        yield Item(
            "card", "NI-DAQmx", f"the package {error.name} is not installed", "missing",
            'pip install "dearig[rig]"',
        )  # fmt: skip
    except LookupError:
        yield Item(
            "card", "NI-DAQmx driver", f"not installed; {only}", "missing",
            "install NI-DAQmx from NI's web site",
        )  # fmt: skip
    else:
        yield Item("card", "NI-DAQmx driver", found.version)
        cards = ", ".join(found.cards)
        yield Item(
            "card", "cards", cards or "none", "ok" if cards else "missing",
            "" if cards else "connect the card, and look for it in NI MAX",
        )  # fmt: skip


def _window() -> Iterator[Item]:
    from dearig.errors import InputError
    from dearig.window.main import require_qt, require_screen

    try:
        require_qt()
    except InputError as error:
        yield Item("window", "Qt", str(error), "missing")
        return
    from PySide6.QtCore import QSettings, qVersion

    yield Item("window", "Qt", str(qVersion()))
    settings = QSettings("dearig", "dearig")
    yield Item("window", "settings", settings.fileName())
    platform_asked = os.environ.get("QT_QPA_PLATFORM", "")
    try:
        require_screen()
    except InputError as error:
        yield Item("window", "screen", str(error), "missing")
    else:
        yield Item("window", "screen", platform_asked or "found")


# ---------------------------------------------------------------- plug-ins


def _left_out() -> dict[str, tuple[str, ...]]:
    """Return the sentences of each registry on the entries that it cannot use, by group."""
    from dearig.acquisition.rigs import RIGS
    from dearig.config.segments import SEGMENT_KINDS
    from dearig.drivers.instruments.registered import INSTRUMENTS
    from dearig.model.effects import PROBLEMS
    from dearig.recording.exporters import EXPORTS
    from dearig.recording.importers import IMPORTERS

    return {
        "segments": SEGMENT_KINDS.left_out,
        "importers": IMPORTERS.left_out,
        "exporters": EXPORTS.left_out,
        "rigs": RIGS.left_out,
        "instruments": INSTRUMENTS.left_out,
        "effects": PROBLEMS,
    }


def _plugins() -> Iterator[Item]:
    left_out = _left_out()
    for group in PLUGIN_GROUPS:
        for point in sorted(metadata.entry_points(group=f"dearig.{group}"), key=lambda p: p.name):
            refusal = _refusal(point, left_out.get(group))
            origin = f" of {point.dist.name} {point.dist.version}" if point.dist else ""
            yield Item(
                "plug-ins", f"{group}: {point.name}", refusal or f"{point.value}{origin}",
                "wrong" if refusal else "ok",
            )  # fmt: skip


def _refusal(point: metadata.EntryPoint, left_out: tuple[str, ...] | None) -> str:
    """Return why ``point`` cannot be used; "" where it can.

    ``left_out`` are the sentences of its registry; without one the entry is only loaded.
    """
    if left_out is not None:
        known = (point.name, point.dist.name if point.dist else "")
        return next((s for s in left_out if all(word in s for word in known)), "")
    try:
        point.load()
    except Exception as error:  # noqa: BLE001  (another distribution's code)
        whose = point.dist.name if point.dist else "its package"
        return (
            f"{point.value} cannot be loaded: {type(error).__name__}: {error}; update or "
            f"uninstall {whose}"
        )
    return ""


# ---------------------------------------------------------------- shown

_STYLES = {"ok": "green", "missing": "yellow", "wrong": "bold red"}


def doctor_table(items: tuple[Item, ...]) -> RenderableType:
    """Return the items as text for the terminal."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    pieces: list[RenderableType] = []
    for section, group in groupby(items, key=lambda item: item.section):
        table = Table(
            title=Text(section, style="bold"), title_justify="left",
            show_header=False, box=None, pad_edge=False,
        )  # fmt: skip
        table.add_column(no_wrap=True, width=max(map(len, _STYLES)))
        table.add_column(overflow="fold")
        for item in group:
            advice = f"; {item.advice}" if item.advice else ""
            table.add_row(
                Text(item.verdict, style=_STYLES[item.verdict]),
                Text(printable(f"{item.name}: {item.found}{advice}")),
            )
        pieces.append(table)
    return Group(*pieces, Text(_summary(items)))


def _summary(items: tuple[Item, ...]) -> str:
    wrong = sum(item.verdict == "wrong" for item in items)
    missing = sum(item.verdict == "missing" for item in items)
    if wrong:
        return f"{wrong} to correct, {missing} missing."
    return f"Nothing to correct; {missing} missing, which only some commands need."


def doctor_json(items: tuple[Item, ...]) -> dict[str, Any]:
    """Return the items for ``--json``."""
    return {
        "format": "dearig-doctor/1",
        "ok": all(item.verdict != "wrong" for item in items),
        "items": [asdict(item) for item in items],
    }
