"""Requests to an ASGI application, without a server and without a client's package."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Reply:
    """Status, headers by their names in small letters, and body."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def text(self) -> str:
        return self.body.decode()

    @property
    def events(self) -> list[dict[str, Any]]:
        """What a stream of server-sent events said."""
        return [json.loads(part.removeprefix("data: ")) for part in self.text.split("\n\n")[:-1]]


def asked(app, path: str = "/", method: str = "GET", events: int = 1, **headers: str) -> Reply:
    """Ask ``app`` for ``path``; a stream is left after so many ``events``."""
    return asyncio.run(ask(app, path, method, events, **headers))


async def ask(app, path: str = "/", method: str = "GET", events: int = 1, **headers: str) -> Reply:
    path, _, query = path.partition("?")
    given = {"host": "127.0.0.1:8642"} | headers
    scope = {
        "type": "http", "http_version": "1.1", "method": method, "scheme": "http", "path": path,
        "raw_path": path.encode(), "root_path": "", "query_string": query.encode(),
        "headers": [(n.encode(), v.encode()) for n, v in given.items()],
        "client": ("127.0.0.1", 5000), "server": ("127.0.0.1", 8642),
    }  # fmt: skip
    found: dict[str, Any] = {}
    body: list[bytes] = []
    left = asyncio.Event()
    requested = False

    async def receive() -> dict[str, Any]:
        nonlocal requested
        if not requested:
            requested = True
            return {"type": "http.request", "body": b"", "more_body": False}
        await left.wait()
        return {"type": "http.disconnect"}

    async def send(message: dict[str, Any]) -> None:
        if message["type"] == "http.response.start":
            found["status"] = message["status"]
            found["headers"] = {n.decode(): v.decode() for n, v in message["headers"]}
        elif message["body"]:
            body.append(message["body"])
            if len(body) >= events:
                left.set()

    await app(scope, receive, send)
    return Reply(found["status"], found["headers"], b"".join(body))
