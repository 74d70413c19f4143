"""The page as an ASGI application: six files, and one stream that only sends."""

from __future__ import annotations

from importlib import resources

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp

from dearig.web.access import AccessGuard
from dearig.web.feed import Feed

__all__ = ["watch_app"]

_FILES = {
    "/": ("page.html", "text/html; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/uplot.js": ("uPlot.iife.min.js", "text/javascript; charset=utf-8"),
    "/uplot.css": ("uPlot.min.css", "text/css; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}


def watch_app(feed: Feed, host: str, port: int, token: str | None) -> ASGIApp:
    """Return the application that shows ``feed`` at ``host`` and ``port``.

    ``token`` is needed to read it, None for the loopback. No request reaches the disk: the files
    are read here.
    """
    assets = resources.files("dearig.web") / "assets"

    def file(path: str, name: str, media: str) -> Route:
        content = (assets / name).read_bytes()

        def answer(_: Request) -> Response:
            return Response(content, media_type=media)

        return Route(path, answer)

    async def live(_: Request) -> Response:
        if feed.full:
            return PlainTextResponse("There are too many watchers.", 503)
        return StreamingResponse(feed.stream(), media_type="text/event-stream")

    routes = [Route("/live", live), *(file(path, *about) for path, about in _FILES.items())]
    return AccessGuard(Starlette(routes=routes), host, port, token)
