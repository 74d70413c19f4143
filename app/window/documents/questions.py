"""Questions before work is lost; each names the work, and its default loses nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime

from PySide6.QtWidgets import QWidget

from dearig.window.documents.dialogs import ask
from dearig.window.kit.widgets import Message
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile, OverwriteQuestion

__all__ = ["confirm_discard", "may_close", "offer_unsaved", "replace_or_tell"]


def confirm_discard(parent: QWidget, session: Session, file: EditedFile, text: str) -> bool:
    """Return True if ``text`` has no unsaved changes, or the operator gives them up."""
    return not file.is_unsaved(text) or ask(
        parent,
        session,
        f"Unsaved {file.what}",
        f"These changes are not saved and will be lost:\n\n{file.changes(text)}",
        "Discard the changes",
        "Cancel",
    )


def may_close(parent: QWidget, session: Session) -> bool:
    """Return True if nothing is unsaved, or the operator closes the window without saving."""
    unsaved = session.recovery.unsaved
    return not unsaved or ask(
        parent,
        session,
        "Unsaved changes",
        "These changes are not saved and will be lost:\n\n" + "\n".join(unsaved),
        "Close without saving",
        "Cancel",
    )


def replace_or_tell(
    parent: QWidget,
    session: Session,
    asked: OverwriteQuestion,
    save: Callable[..., None],
    trouble: Message,
) -> None:
    """Ask whether a file that another program has changed may be replaced.

    Calls ``save(path, replace=True)`` if so; else ``trouble`` says that nothing was written.
    """
    agreed = ask(
        parent,
        session,
        "Changed by another program",
        f"{asked.sentence}. Replacing it loses what that program has written. To keep both, cancel "
        f"and save under another name.",
        "Replace the file",
        "Cancel",
    )
    if agreed:
        save(asked.path, replace=True)
    else:
        trouble.show_text(f"{asked.sentence}; nothing was written")


def offer_unsaved(
    parent: QWidget, session: Session, restore: Mapping[str, Callable[[str, EditedFile], None]]
) -> None:
    """Offer the unsaved texts of windows that ended without a question, and restore them.

    ``restore`` takes the text and the file of each kind. What is refused is offered again at the
    next start.
    """
    for path, texts in session.recovery.found():
        at = datetime.fromtimestamp(max(text.at for text in texts.values())).astimezone()
        lines = "\n".join(text.changes for text in texts.values())
        if ask(
            parent,
            session,
            "Unsaved changes",
            f"The window ended on {at:%d %B at %H:%M} before these changes were saved:\n\n{lines}",
            "Restore them",
            "Not now",
        ):
            for what, text in texts.items():
                if what in restore:
                    restore[what](text.text, text.file(what))
            session.recovery.write()  # before the older file goes
            path.unlink(missing_ok=True)
        return
