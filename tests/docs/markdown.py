"""What the documents show: links, blocks of code, and commands."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).parents[2]
FOLDERS = ("app", "drivers", "findings", "model", "recordings", "sim_backend", "tests")


@dataclass(frozen=True)
class Block:
    """A fenced block. ``reason`` says why it is not run: ``sh (needs a card)``; empty if it is."""

    path: str
    line: int
    language: str
    reason: str
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}"

    @property
    def commands(self) -> list[list[str]]:
        """Words of each command line of a shell block, comments taken off."""
        lines = self.text.replace("\\\n", " ").splitlines()
        words = [shlex.split(line.removeprefix("$ "), comments=True) for line in lines]
        return [w for w in words if w]


@cache
def documents() -> tuple[str, ...]:
    """Paths of all Markdown files of the repository."""
    found = [
        *ROOT.glob("*.md"),
        *(file for name in FOLDERS for file in (ROOT / name).rglob("*.md")),
    ]
    return tuple(sorted(file.relative_to(ROOT).as_posix() for file in found))


@cache
def _tokens(path: str) -> tuple[Token, ...]:
    parser = MarkdownIt("commonmark").enable("table")
    return tuple(parser.parse((ROOT / path).read_text(encoding="utf-8")))


@cache
def _fences(path: str) -> tuple[Token, ...]:
    # they are needed to collect the tests: what stands within lines takes most of the time
    parser = MarkdownIt("commonmark").disable("inline")
    found = parser.parse((ROOT / path).read_text(encoding="utf-8"))
    return tuple(token for token in found if token.type == "fence")


def blocks(path: str) -> Iterator[Block]:
    """All fenced blocks of a document."""
    for token in _fences(path):
        language, _, rest = token.info.partition(" ")
        line = token.map[0] + 1 if token.map else 0
        yield Block(path, line, language, rest.strip().strip("()"), token.content)


def links(path: str) -> Iterator[str]:
    """Targets of all links and pictures of a document."""
    for child in _inline(path):
        target = child.attrs.get("href") or child.attrs.get("src")
        if target:
            yield str(target)


def inline_code(path: str) -> Iterator[str]:
    """All code within lines."""
    return (child.content for child in _inline(path) if child.type == "code_inline")


def inline_commands(path: str) -> Iterator[str]:
    """Code within lines that begins with ``dearig`` and a space."""
    return (text for text in inline_code(path) if re.match(r"dearig [a-z-]", text))


def _inline(path: str) -> Iterator[Token]:
    for token in _tokens(path):
        yield from token.children or ()
