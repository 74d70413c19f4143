"""Errors that end a command early, each with its exit code and a sentence for the operator."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dearig.output_state import OutputState

__all__ = [
    "DearigError",
    "DiskFault",
    "Hints",
    "InputError",
    "InstrumentFault",
    "Interrupted",
    "NotSafe",
    "Note",
    "Remedy",
    "SafetyStop",
    "hints_of",
    "noted",
]


class Hints:
    """Names of what a text is about, which each face of the program words in its own way.

    ``options`` are names of values that a person can give, such as ``gauge_length_mm``: an option
    of the command, a field of the window, an argument in Python. ``command`` is a command of the
    program that helps, with its arguments, () for none; the ``options`` are then those of it.
    """

    options: tuple[str, ...] = ()
    command: tuple[str, ...] = ()


class Note(str, Hints):
    """Text for a person, with the options and the command that it is about."""

    __slots__ = ("command", "options")

    def __new__(
        cls, text: str, option: str | Iterable[str] = (), command: Sequence[str] = ()
    ) -> Note:
        """Return ``text`` with one ``option`` or several, and a ``command`` that helps."""
        note = super().__new__(cls, text)
        note.options = (option,) if isinstance(option, str) else tuple(option)
        note.command = tuple(command)
        return note


@dataclass(frozen=True)
class Remedy:
    """Command of the program that solves an error, with the values of its options.

    ``command`` is its name with its arguments. ``values`` are pairs of an option and its value,
    True for an option without one. ``holes`` stand in the values for what only a person knows;
    ``is_guess`` says that a person must check the values first.
    """

    command: tuple[str, ...]
    values: tuple[tuple[str, str | float], ...] = ()
    holes: tuple[str, ...] = ()
    is_guess: bool = False


class DearigError(Exception, Hints):
    """An error whose text tells the operator what happened, where, and what to do.

    The text names no option of a command and no field of the window: ``option``, a name or
    several, and ``command`` say what each face adds to it (``Hints``). ``remedy`` is a whole
    command that solves it, None without one.

    ``output_state`` is what is known of the rig's output where the error ended a run, and None
    where no rig was contacted.
    """

    exit_code = 1
    output_state: OutputState | None = None

    def __init__(
        self,
        *text: object,
        option: str | Iterable[str] = (),
        command: Sequence[str] = (),
        remedy: Remedy | None = None,
    ) -> None:
        super().__init__(*text)
        self.options = (option,) if isinstance(option, str) else tuple(option)
        self.command = tuple(command)
        self.remedy = remedy

    @property
    def needs_inspection(self) -> bool:
        """Whether a person must look at the rig before it is used again.

        True where an interlock or a fault ended a run, and where 0 V is not confirmed after it;
        False where no rig was contacted.
        """
        if self.output_state is None:
            return isinstance(self, NotSafe)
        return isinstance(self, SafetyStop | InstrumentFault) or not self.output_state.confirmed


class InputError(DearigError):
    """Wrong input or usage; nothing was changed."""

    exit_code = 2


class SafetyStop(DearigError):  # noqa: N818  (the name of what happened)
    """A safety limit stopped the run; the rig was made safe."""

    exit_code = 3


class InstrumentFault(DearigError):  # noqa: N818
    """An instrument failed or is missing."""

    exit_code = 4


class NotSafe(InstrumentFault):
    """The voltage may still be on: neither the run nor its guardian could bring it to 0 V."""


class DiskFault(DearigError):  # noqa: N818
    """The disk could not be written during a run; the rig was made safe.

    It has the exit code of an instrument fault: the input was right and the equipment failed.
    """

    exit_code = 4


class Interrupted(DearigError):  # noqa: N818
    """The operator stopped the work; after a run the rig was made safe."""

    exit_code = 130


def hints_of(text: str | BaseException) -> list[Hints]:
    """Return the hints of a text or an error, and of the errors that it was raised from."""
    found: list[Hints] = []
    cause: object = text
    while isinstance(cause, Hints):
        if cause.options or cause.command:
            found.append(cause)
        cause = cause.__cause__ if isinstance(cause, DearigError) else None
    return found


def noted(error: DearigError) -> Note:
    """Return what ``error`` says with all its hints, as a text that goes to another process."""
    hints = hints_of(error)
    options = dict.fromkeys(option for hint in hints for option in hint.options)
    return Note(str(error), options, next((h.command for h in hints if h.command), ()))
