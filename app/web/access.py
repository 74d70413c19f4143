"""Who may read the page, and headers that keep other pages away from it.

Without a token the page answers only to names of the loopback. So a page of the internet whose name
was pointed at the loopback (DNS rebinding) is refused by its ``Host`` header, and one that asks
across origins by its ``Origin`` header.
"""

from __future__ import annotations

import hmac
import ipaddress
import socket
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["AccessGuard", "is_loopback"]

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def is_loopback(host: str) -> bool:
    """Return True if only this computer reaches the address or name ``host``."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class AccessGuard:
    """Lets only requests through to ``app`` that may read the page, which is shown at ``host``.

    ``token`` None admits everybody who reaches the loopback. A request shows the token in its
    address once, and gets a cookie for it, or in the header ``Authorization: Bearer``.
    """

    def __init__(self, app: ASGIApp, host: str, port: int, token: str | None) -> None:
        self._app, self._token = app, token
        self._shared = not is_loopback(host)
        own = socket.gethostname().lower()
        self._names = {host.lower(), own, f"{own}.local"} if self._shared else set()
        # browsers send the cookies of a name to all of its ports
        self._cookie = f"dearig_watch_{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            # a websocket: the page needs none
            await send({"type": "websocket.close", "code": 1008})
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        answer = self._refusal(scope)
        await (self._app if answer is None else answer)(scope, receive, guarded)

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return PlainTextResponse("This name is not one of this page.", 421)
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc.lower() != hosts[0].lower():
            return PlainTextResponse("Other pages may not read this one.", 403)
        if scope["method"] != "GET":
            return PlainTextResponse("This page can only be read.", 405, {"Allow": "GET"})
        if self._token is None:
            return None
        shown = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        if shown:
            if not self._is_token(shown[0]):
                return _without_token()
            answer = RedirectResponse("/", 303)
            answer.set_cookie(self._cookie, self._token, httponly=True, samesite="lax")
            return answer
        scheme, _, given = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and self._is_token(given.strip()):
            return None
        return None if self._is_token(self._from_cookie(headers)) else _without_token()

    def _is_own(self, host: str) -> bool:
        """Return True if ``host``, with or without a port, names this page.

        A shared page answers to any numeric address too: DNS rebinding needs a name.
        """
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if is_loopback(name) or name in self._names:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return self._shared

    def _is_token(self, given: str) -> bool:
        assert self._token is not None  # noqa: S101  (asked for only where there is one)
        return hmac.compare_digest(given.encode(), self._token.encode())

    def _from_cookie(self, headers: Headers) -> str:
        try:
            found = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return ""
        return "" if found is None else found.value


def _without_token() -> Response:
    return PlainTextResponse(
        "This page needs its token: open the address that was printed when it was started.", 401
    )
