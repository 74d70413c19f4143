"""What the tutorial's commands print: ``python -m tests.docs.tutorial`` writes it again.

A block of text shows lines of what the commands before it print, in their order. Its numbers come
from the commands; which lines it shows is decided by hand. Two fits take some minutes.
"""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from unittest.mock import patch

from tests.docs.markdown import ROOT, Block, blocks
from tests.tools.command import done

PAGE = "app/docs/tutorial.md"
_NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")
#: Columns of the terminal whose lines are shown.
_COLUMNS = "100"


class Stale(Exception):  # noqa: N818  (what was found)
    """A line that is shown is no longer printed: choose another one by hand."""


def shape(line: str) -> str:
    """Return ``line`` without its numbers and the width of its columns."""
    return " ".join(_NUMBER.sub("#", line).split())


def numbers(line: str) -> list[float]:
    """Return the numbers in ``line``."""
    return [float(n.replace(",", "")) for n in _NUMBER.findall(line)]


def renewed(shown: str, printed: str) -> str:
    """Return the lines of ``shown`` as they are in ``printed``, in the same order.

    Raises ``Stale`` for a line whose words are not printed after those before it.
    """
    left = iter(printed.splitlines())
    found = []
    for line in shown.splitlines():
        new = next((other for other in left if shape(other) == shape(line)), None)
        if new is None:
            raise Stale(f"{line!r} is not printed any more")
        found.append(new.rstrip())
    return "\n".join(found) + "\n"


def played(page: Sequence[Block], folder: Path) -> Iterator[tuple[Block, str]]:
    """Yield each block of text of a ``page``, and what the commands before it print in ``folder``.

    Blocks of commands that a test does not run are played too where only their time is the reason.
    """
    last = max(i for i, block in enumerate(page) if block.language == "text")
    printed = ""
    with contextlib.chdir(folder), patch.dict(os.environ, COLUMNS=_COLUMNS):
        for block in page[: last + 1]:
            if block.language == "text":
                yield block, printed
            elif block.language == "sh" and (not block.reason or "slow" in block.reason):
                printed = "".join(done(*words[1:]).out for words in block.commands)


def main() -> None:
    """Play the commands of the tutorial, and write what they print into it."""
    path = ROOT / PAGE
    text = path.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        for block, printed in played(list(blocks(PAGE)), Path(folder)):
            text = text.replace(block.text, renewed(block.text, printed))
    path.write_text(text, encoding="utf-8", newline="\n")
    print(path)


if __name__ == "__main__":
    main()
