"""Settings of notifications: the keys of ``[notify]`` in a plan, and their allowed values."""

from __future__ import annotations

import os
import shlex
import shutil
from dataclasses import dataclass, field, replace
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field

from dearig.config.toml_input import TomlTable
from dearig.errors import InputError

__all__ = ["EVENTS", "Notify", "NotifyTable", "notify_text", "redacted"]

Event = Literal["run-ended", "tripped", "queue-stopped"]

#: Events: a run has ended; a run has ended so that a person must look; no further run follows.
EVENTS: tuple[Event, ...] = ("run-ended", "tripped", "queue-stopped")
#: Begins the name of a variable of the environment that has the address.
_VARIABLE = "env:"


@dataclass(frozen=True)
class Notify:
    """Settings of notifications of the events ``on``: by ``command``, ``webhook``, both or neither.

    ``command`` is a program with its arguments, () for none. ``webhook`` is an address, which may
    be a secret, or ``env:NAME``; "" for none. After ``timeout`` s the command is killed, and no
    answer of the webhook is awaited.
    """

    command: tuple[str, ...] = ()
    webhook: str = field(default="", repr=False)
    on: tuple[Event, ...] = EVENTS
    timeout: float = 30.0

    def checked(self) -> Notify:
        """Return the settings with the program's path and the webhook's address.

        Raises ``InputError`` for a command or an address that cannot work: without this check
        no one would notice it until a campaign of days ends.
        """
        command = self.command
        if command:
            if any("\0" in part for part in command):
                raise InputError("notify.command has a character of number 0 in it")
            program = shutil.which(command[0])
            if program is None:
                raise InputError(
                    f"notify.command: the program {command[0]!r} is not there, or is none; give "
                    f"its path, or install it"
                )
            command = (program, *command[1:])
        return replace(self, command=command, webhook=_address(self.webhook))


def notify_text(notify: Notify) -> str:
    """Return a sentence on what ``notify`` starts and whom it tells, "" for nothing."""
    means = [
        *([f"starts {shlex.join(notify.command)}"] if notify.command else []),
        *([f"posts to {redacted(notify.webhook)}"] if notify.webhook else []),
    ]
    return f"at {', '.join(notify.on)} this {' and '.join(means)}" if means else ""


class NotifyTable(TomlTable):
    """The table ``[notify]`` of a plan."""

    command: list[str] = Field(
        default_factory=list, max_length=100, description="a program and its arguments",
        examples=[["program", "argument"]],
    )  # fmt: skip
    webhook: str = Field(
        default="", description="an address that takes JSON, or env:NAME for a variable with one"
    )
    on: list[Event] = Field(
        default_factory=lambda: list(EVENTS), min_length=1, description="events to report"
    )
    timeout_s: float = Field(
        default=Notify.timeout, gt=0.0, le=3600.0, allow_inf_nan=False,
        description="time for the program, and for the answer of the webhook",
    )  # fmt: skip

    def settings(self) -> Notify:
        """Return the settings of the table."""
        return Notify(tuple(self.command), self.webhook, tuple(self.on), self.timeout_s)


def _address(webhook: str) -> str:
    """Return the address that ``webhook`` is or names, "" for none. Raises ``InputError``."""
    where = "notify.webhook"
    if webhook.startswith(_VARIABLE):
        name = webhook.removeprefix(_VARIABLE)
        where = f"the variable {name} of notify.webhook"
        webhook = os.environ.get(name, "")
        if not webhook:
            raise InputError(f"notify.webhook: the environment has no variable {name!r}")
    if not webhook:
        return ""
    try:
        parts = urlsplit(webhook)
        good = bool(parts.hostname) and parts.scheme in ("http", "https") and parts.port != 0
        named = parts.username is not None
    except ValueError:
        good = named = False
    if not good or not webhook.isascii() or not webhook.isprintable() or " " in webhook:
        raise InputError(f"{where} is not an address such as https://example.org/hook")
    if named:
        raise InputError(f"{where} has a name or a password before its host: it is not sent so")
    return webhook


def redacted(webhook: str) -> str:
    """Return the webhook's server, without the rest of its address, which may be a secret."""
    parts = urlsplit(webhook)
    return f"{parts.scheme}://{parts.netloc}/..."
