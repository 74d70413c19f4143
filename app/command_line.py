"""The command line of this process, as logs and reports may show it."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["WEBHOOK_OPTION", "without_secrets"]

#: Option whose value may be a secret: an address to which anyone may post who knows it.
WEBHOOK_OPTION = "--notify-webhook"


def without_secrets(arguments: Sequence[str]) -> list[str]:
    """Return the ``arguments`` of a command without the address of a webhook."""
    shown: list[str] = []
    for argument in arguments:
        if shown and shown[-1] == WEBHOOK_OPTION:
            argument = "..."
        elif argument.startswith(f"{WEBHOOK_OPTION}="):
            argument = f"{WEBHOOK_OPTION}=..."
        shown.append(argument)
    return shown
