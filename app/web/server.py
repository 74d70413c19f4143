"""The server of the page: its address, its token, and its end by ctrl-C."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from dearig.batch.watching import SourceWatch
from dearig.errors import InputError
from dearig.extras import import_extra
from dearig.input_file import read_input
from dearig.recording.files import system_text

if TYPE_CHECKING:
    from uvicorn import Server

__all__ = ["WatchServer", "serve_watch", "token_from"]

#: Characters of a token that a person made, at least and at most.
TOKEN_MIN, TOKEN_MAX = 16, 200
_PURPOSE = "the web page that shows a run"


def token_from(path: Path) -> str:
    """Return the token in the file ``path``. Raises ``InputError`` for one that is not safe."""
    text = read_input(path, "token file", 10_000).decode("utf-8", "replace").strip()
    if not (TOKEN_MIN <= len(text) <= TOKEN_MAX and text.isascii() and text.isprintable()):
        raise InputError(
            f"{path} has no token: it is one line of {TOKEN_MIN} to {TOKEN_MAX} ASCII characters, "
            f'such as those that python -c "import secrets; print(secrets.token_urlsafe())" prints'
        )
    if set(text) & set(' "\\;,'):
        raise InputError(f"{path}: a token has no blanks, quotes, commas and semicolons")
    return text


class WatchServer:
    """Shows ``watch`` at ``host`` and ``port`` (0 for a free one), which are taken at once.

    An address that other computers reach needs a token: ``token``, or one that is made here.
    Raises ``InputError`` for an address that cannot be taken, and where the extra is missing.
    """

    def __init__(
        self, watch: SourceWatch, host: str, port: int, token: str | None, every: float
    ) -> None:
        uvicorn = import_extra("uvicorn", "web", _PURPOSE)
        import_extra("starlette", "web", _PURPOSE)
        from dearig.web.access import is_loopback
        from dearig.web.app import watch_app
        from dearig.web.feed import Feed
        from dearig.web.patience import PatientProtocol
        from dearig.web.state import look

        self._socket = _listen(host, port)
        self.port = int(self._socket.getsockname()[1])
        self.shared = not is_loopback(host)
        if self.shared and token is None:
            token = secrets.token_urlsafe(32)
        feed = Feed(lambda: look(watch), every, lambda: bool(self._server.should_exit))
        config = uvicorn.Config(
            watch_app(feed, host, self.port, token),
            # the log would have the token, and a page that was opened is not news
            log_config=None, access_log=False, log_level="error", server_header=False,
            http=PatientProtocol, ws="none", lifespan="off", limit_concurrency=200,
            timeout_graceful_shutdown=3,
        )  # fmt: skip
        self._server: Server = uvicorn.Server(config)
        name = host
        if host in ("0.0.0.0", "::", ""):  # noqa: S104  (a name for all addresses)
            name = socket.gethostname()
        if ":" in name:
            name = f"[{name}]"
        shown = "" if token is None else f"?token={quote(token)}"
        self.address = f"http://{name}:{self.port}/{shown}"

    def run(self) -> None:
        """Serve the page until ctrl-C or ``stop``."""
        with self._socket:
            self._server.run(sockets=[self._socket])

    def stop(self) -> None:
        """End ``run``, also from another thread."""
        self._server.should_exit = True


def serve_watch(
    watch: SourceWatch,
    port: int,
    host: str | None,
    token: str | None,
    every: float,
    started: Callable[[str, bool], None],
) -> None:
    """Show ``watch`` as a web page until ctrl-C.

    ``started`` is called with the address, and with True where other computers reach it.
    """
    server = WatchServer(watch, host or "127.0.0.1", port, token, every)
    started(server.address, server.shared)
    try:
        server.run()
    except KeyboardInterrupt:
        return  # the end that a watcher has


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=100)
    except OSError as error:
        raise InputError(
            f"the page cannot be shown at {host}, port {port}: {system_text(error)}; give another "
            f"port, or 0 for a free one",
            option="port",
        ) from error
