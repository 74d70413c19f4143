"""The list of documents: every Markdown file of the package, in reading order.

A page is named by its path in the repository, in which its relative links are written too:
``app/docs/tutorial.md``, ``drivers/SAFETY.md``. An installed package has the same files under
``dearig/``. A new page needs no registration: it is a new ``.md`` file in a folder of the package.
"""

from __future__ import annotations

import difflib
import importlib.util
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePosixPath

from dearig.errors import InputError

__all__ = ["HOME", "OPEN_SECTIONS", "DocumentPage", "file_at", "page_at", "page_named", "pages"]

#: The page that opens first.
HOME = "app/docs/README.md"
#: Folders of the repository that have documents, with the packages that they are installed as.
_FOLDERS = {
    "app": "dearig",
    "drivers": "dearig.drivers",
    "model": "dearig.model",
    "sim_backend": "dearig.sim_backend",
}
#: Sections in reading order, with the beginnings of the paths that belong to each.
_SECTIONS = (
    ("Start", (HOME, "app/docs/tutorial.md", "app/docs/window.md")),
    ("How to", ("app/docs/how-to/",)),
    ("Explanation", ("app/docs/explanation/",)),
    ("Reference", ("app/docs/reference/",)),
    ("Next to the code", ("app/", "drivers/", "model/", "sim_backend/")),
    ("Decisions", ("app/docs/decisions/",)),
)
#: Sections whose pages the navigation shows on every page.
OPEN_SECTIONS = tuple(name for name, _ in _SECTIONS[:-1])


@dataclass(frozen=True)
class DocumentPage:
    """One document.

    Attributes
    ----------
    path : str
        Path in the repository, with forward slashes.
    title : str
        Its first heading.
    section : str
        Section of the navigation.
    file : pathlib.Path
        The Markdown file.
    """

    path: str
    title: str
    section: str
    file: Path

    @property
    def text(self) -> str:
        """The Markdown text."""
        return self.file.read_text(encoding="utf-8")


@cache
def pages() -> tuple[DocumentPage, ...]:
    """Return all documents in reading order."""
    found = [
        DocumentPage(path, _title(file), _SECTIONS[_section(path)][0], file)
        for path, file in _documents()
    ]
    return tuple(sorted(found, key=lambda page: _order(page.path)))


def page_at(path: str) -> DocumentPage | None:
    """Return the page with this path in the repository; None if there is none."""
    return next((page for page in pages() if page.path == path), None)


def page_named(name: str) -> DocumentPage:
    """Return the page that a person means by ``name``.

    ``name`` is a path (``drivers/SAFETY.md``), the end of one (``commands``, ``how-to/rig-pc``),
    or, for a README, its folder (``drivers``), in any case of letters.

    Raises
    ------
    InputError
        If no page has this name, or several have it.
    """
    wanted = name.replace("\\", "/").strip("/").lower().removesuffix(".md")
    names = {page: _names(page.path) for page in pages()}
    for depth in range(max(len(n) for n in names.values())):
        found = [page for page, known in names.items() if wanted in known[depth : depth + 1]]
        if len(found) == 1:
            return found[0]
        if found:
            several = ", ".join(page.path for page in found)
            raise InputError(f"{name!r} names several documents: {several}; give more of the path")
    known = sorted({n[0] for n in names.values()})
    near = difflib.get_close_matches(wanted, {n for ns in names.values() for n in ns}, n=3)
    raise InputError(
        f"no document is named {name!r}; "
        + (f"near to it: {', '.join(near)}; " if near else "")
        + f"there are {', '.join(known)}"
    )


def file_at(path: str) -> Path | None:
    """Return the packaged file with this path in the repository; None if it is not packaged."""
    folder, _, rest = path.partition("/")
    if folder not in _FOLDERS or not rest:
        return None
    file = _root(folder) / rest
    return file if file.is_file() else None


def _names(path: str) -> list[str]:
    """Names of a page from the shortest to the whole path, in lower case, without the ending."""
    parts = PurePosixPath(path.lower()).with_suffix("").parts
    if parts[-1] == "readme" and path != HOME:
        parts = parts[:-1]
    return ["/".join(parts[i:]) for i in range(len(parts) - 1, -1, -1)]


def _documents() -> Iterator[tuple[str, Path]]:
    for folder in _FOLDERS:
        root = _root(folder)
        for file in root.rglob("*.md"):
            inside = file.relative_to(root)
            # an installed dearig/ holds the other folders too
            if folder == "app" and inside.parts[0] in _FOLDERS:
                continue
            yield f"{folder}/{inside.as_posix()}", file


def _root(folder: str) -> Path:
    """Folder on this computer: in a checkout next to the others, installed inside ``dearig``."""
    spec = importlib.util.find_spec(_FOLDERS[folder])
    if spec is None or not spec.submodule_search_locations:
        raise InputError(f"the package {_FOLDERS[folder]} is not installed; install dearig again")
    return Path(spec.submodule_search_locations[0])


def _section(path: str) -> int:
    """Index of the section whose beginning fits the path best."""
    fits = [
        (len(start), index)
        for index, (_, starts) in enumerate(_SECTIONS)
        for start in starts
        if path.startswith(start)
    ]
    return max(fits)[1]


def _order(path: str) -> tuple[int, int, int, str]:
    """Sort by section, in it by place, a README before its siblings, the rest by name."""
    section = _section(path)
    starts = _SECTIONS[section][1]
    place = next(i for i, start in enumerate(starts) if path.startswith(start))
    folder, _, name = path.rpartition("/")
    return section, place, 0, f"{folder}/ {name}" if name == "README.md" else path


def _title(file: Path) -> str:
    heading = re.search(r"^# (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    return heading[1].replace("`", "") if heading else file.stem
