"""Documents as HTML pages: Markdown by markdown-it-py, code by Pygments, the frame by Jinja2."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable
from functools import cache
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dearig.docs.pages import OPEN_SECTIONS, DocumentPage, file_at, page_at, pages
from dearig.errors import InputError
from dearig.formulas import as_text, mathml

__all__ = ["anchors", "build", "slug", "to_html"]

#: Maps a link's path in the repository to an address, or to None where it leads nowhere.
Address = Callable[[str], str | None]


def to_html(page: DocumentPage, address: Address | None = None, *, formulas: bool = True) -> str:
    """Return the body of a page as HTML.

    Parameters
    ----------
    page : Page
    address : callable, optional
        Maps the repository's path of a linked file to the address in the HTML. Where it returns
        None (a file that is not packaged) the link's text is shown without a link. By default the
        path itself is the address.
    formulas : bool
        Formulas are MathML; otherwise text, for a viewer without MathML.
    """
    parser = _markdown()
    tokens = parser.parse(page.text)
    _number_headings(tokens)
    for token in tokens:
        if token.type == "inline" and token.children:
            token.children = _relinked(token.children, page.path, address or str)
    return str(parser.renderer.render(tokens, parser.options, {"formulas": formulas}))


def anchors(text: str) -> list[str]:
    """Return the anchors of all headings of a Markdown text, in order."""
    tokens = _markdown().parse(text)
    _number_headings(tokens)
    return [str(t.attrs["id"]) for t in tokens if t.type == "heading_open"]


def slug(heading: str, taken: dict[str, int]) -> str:
    """Return the anchor of a heading, as GitHub makes it; ``taken`` counts those given before."""
    name = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
    number = taken.get(name, 0)
    taken[name] = number + 1
    return name if number == 0 else f"{name}-{number}"


def build(
    folder: Path, write: Callable[[Path, bytes], object] = Path.write_bytes
) -> dict[str, Path]:
    """Write every page, with its pictures, into ``folder``; ``write`` writes one file.

    Returns
    -------
    dict of str to pathlib.Path
        The HTML file of each page, by the page's path in the repository.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    frame = Environment(
        loader=PackageLoader("dearig.docs", "."),
        autoescape=select_autoescape(["html", "j2"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    ).get_template("page.html.j2")
    every = pages()
    written: dict[str, Path] = {}
    try:
        for index, page in enumerate(every):
            target = folder / _html(page.path)
            target.parent.mkdir(parents=True, exist_ok=True)
            here = posixpath.dirname(page.path)

            def to(path: str, here: str = here) -> str:
                return posixpath.relpath(_html(path), here)

            def linked(path: str, to: Callable[[str], str] = to) -> str | None:
                if page_at(path) is not None:
                    return to(path)
                picture = file_at(path) if path.endswith((".png", ".svg")) else None
                if picture is None:
                    return None
                copy = folder / path
                copy.parent.mkdir(parents=True, exist_ok=True)
                write(copy, picture.read_bytes())
                return to(path)

            html = frame.render(
                page=page,
                body=to_html(page, linked),
                headings=_headings(page.text),
                sections=_sections(page, every, to),
                previous=_neighbour(every, index - 1, to),
                following=_neighbour(every, index + 1, to),
                version=version("dearig"),
                code_style=_code_style(),
            )
            write(target, html.encode("utf-8"))
            written[page.path] = target
    except OSError as error:
        raise InputError(
            f"the documents cannot be written to {folder}: {error.strerror or error}; "
            f"name another folder",
            option="out",
        ) from error
    return written


def _html(path: str) -> str:
    return f"{path.removesuffix('.md')}.html" if path.endswith(".md") else path


def _sections(
    shown: DocumentPage, every: tuple[DocumentPage, ...], to: Callable[[str], str]
) -> list[dict[str, Any]]:
    """Sections of the navigation with their pages as (title, address, path).

    All are open but the long list of decisions, which opens on a page of its own.
    """
    sections: dict[str, list[tuple[str, str, str]]] = {}
    for page in every:
        sections.setdefault(page.section, []).append((page.title, to(page.path), page.path))
    return [
        {"name": name, "pages": found, "open": name in (shown.section, *OPEN_SECTIONS)}
        for name, found in sections.items()
    ]


def _neighbour(
    every: tuple[DocumentPage, ...], index: int, to: Callable[[str], str]
) -> tuple[str, str] | None:
    if not 0 <= index < len(every):
        return None
    return every[index].title, to(every[index].path)


def _headings(text: str) -> list[tuple[str, str]]:
    """Second-level headings as (text, anchor)."""
    tokens = _markdown().parse(text)
    _number_headings(tokens)
    return [
        (_plain(tokens[i + 1]), str(token.attrs["id"]))
        for i, token in enumerate(tokens)
        if token.type == "heading_open" and token.tag == "h2"
    ]


def _plain(inline: Any) -> str:
    return "".join(
        child.content for child in inline.children if child.type in ("text", "code_inline")
    )


def _number_headings(tokens: list[Any]) -> None:
    taken: dict[str, int] = {}
    for i, token in enumerate(tokens):
        if token.type == "heading_open":
            token.attrSet("id", slug(_plain(tokens[i + 1]), taken))


def _relinked(children: list[Any], page: str, address: Address) -> list[Any]:
    """Point links and pictures to where they lead; drop links to files that are not packaged."""
    kept: list[Any] = []
    dropped = 0
    for child in children:
        name = {"link_open": "href", "image": "src"}.get(child.type)
        if name is not None:
            target = str(child.attrs[name])
            where, mark, anchor = target.partition("#")
            if where and not re.match(r"[a-z][a-z0-9+.-]*:", where, re.IGNORECASE):
                path = posixpath.normpath(posixpath.join(posixpath.dirname(page), where))
                if page_at(f"{path}/README.md") is not None:
                    path = f"{path}/README.md"
                found = address(path)
                if found is None and child.type == "link_open":
                    dropped += 1
                    continue
                child.attrSet(name, (found or target) + mark + anchor)
        elif child.type == "link_close" and dropped:
            dropped -= 1
            continue
        kept.append(child)
    return kept


@cache
def _markdown() -> Any:
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"highlight": _highlighted})
    # wide tables scroll by themselves, so that the page does not
    parser.add_render_rule("table_open", lambda *_: '<div class="table"><table>\n')
    parser.add_render_rule("table_close", lambda *_: "</table></div>\n")
    parser.add_render_rule("fence", _fence)
    return parser.enable(["table", "strikethrough"])


def _fence(renderer: Any, tokens: list[Any], at: int, options: Any, env: Any) -> str:
    """A block of code, or a formula where its language is ``math``."""
    if tokens[at].info.strip() != "math":
        return str(renderer.fence(tokens, at, options, env))
    formula = " ".join(tokens[at].content.split())
    if env.get("formulas", True):
        return f'<div class="formula">{mathml(formula)}</div>\n'
    return f"<pre><code>{escape(as_text(formula))}</code></pre>\n"


def _highlighted(code: str, language: str, _attributes: str) -> str:
    from pygments import highlight
    from pygments.formatters import HtmlFormatter
    from pygments.lexers import get_lexer_by_name
    from pygments.util import ClassNotFound

    try:
        lexer = get_lexer_by_name(language)
    except ClassNotFound:
        return ""  # markdown-it shows it as it is
    return str(highlight(code, lexer, HtmlFormatter(nowrap=True)))


@cache
def _code_style() -> str:
    from pygments.formatters import HtmlFormatter

    light = HtmlFormatter(style="default").get_style_defs("pre")
    dark = HtmlFormatter(style="github-dark").get_style_defs("pre")
    return f"{light}\n@media screen and (prefers-color-scheme: dark) {{\n{dark}\n}}"
