"""The command ``dearig docs``: the documents as pages in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, console_for, print_line, write_result
from dearig.errors import InputError

__all__ = ["docs"]


def docs(
    page: Annotated[
        str | None,
        typer.Argument(
            metavar="PAGE",
            help="Page to open, such as tutorial, commands, rig-pc or drivers.",
            show_default="the list of documents",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder for the pages.",
            show_default="the user's cache folder",
        ),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    json: Json = None,
    force: Force = False,
) -> None:
    """Build the documents as HTML pages and open them in the browser, without a network."""
    import webbrowser

    from dearig.docs import HOME, build, page_named, pages
    from dearig.model.compiled.trusted_folder import cache_root
    from dearig.recording.files import write_whole
    from dearig.recording.result_folder import result_folder

    check_files(force, (), json=json)
    wanted = HOME if page is None else page_named(page).path
    if out is not None:
        folder = result_folder(out, force)
    elif (cache := cache_root()).path is not None:
        folder = cache.path / "docs"
    else:
        raise InputError(f"there is no folder for the pages: {cache.note}; name one with --out")
    written = {path: file.resolve() for path, file in build(folder, write_whole).items()}
    print_line(console_for(json), str(written[wanted]))
    listed = [
        {"title": p.title, "section": p.section, "path": p.path, "html": str(written[p.path])}
        for p in pages()
    ]
    write_result({"format": "dearig-docs/1", "page": str(written[wanted]), "pages": listed}, json)
    if browser and not webbrowser.open(written[wanted].as_uri()):
        print_line(console_for("-"), f"no browser was found; open {written[wanted]} in one")
