"""The command ``dearig docs``: the documents as pages in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["docs"]


def docs(
    page: Annotated[
        str,
        typer.Argument(
            metavar="PAGE",
            help="A page, such as tutorial, commands, rig-pc or drivers.",
            show_default="the first page",
        ),
    ] = "",
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
    force: Annotated[
        bool, typer.Option("--force", help="Write into a folder that is not empty.")
    ] = False,
) -> None:
    """Build the documents as HTML pages and open them in the browser; works without a network."""
    import webbrowser

    from platformdirs import user_cache_path

    from dearig.docs import HOME, build, page_named
    from dearig.recording.result_folder import result_folder

    wanted = page_named(page).path if page else HOME
    folder = user_cache_path("dearig") / "docs" if out is None else result_folder(out, force)
    opened = build(folder)[wanted].resolve()
    typer.echo(str(opened))
    if browser and not webbrowser.open(opened.as_uri()):
        typer.echo(f"no browser was found; open {opened} yourself", err=True)
