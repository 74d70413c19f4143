"""What the operator chooses for the columns of a file, and the options of the import it makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from dearig.errors import DearigError, hints_of
from dearig.recording.importers.listing import ColumnGuesses, ColumnPreview, Guessed
from dearig.recording.importers.quantities.labels import DIMENSIONS, RAW, target_name
from dearig.recording.importers.quantities.units import UNITS

__all__ = [
    "AT_CARD",
    "LABELS",
    "ColumnChoice",
    "columns_option",
    "first_choices",
    "kind_of",
    "problems",
    "quantity_label",
    "unit_label",
    "units_of",
    "with_labels",
]

#: Unit of an instrument's output in volts, which the rig file scales.
AT_CARD = "raw_V"
_UNIT_LABELS = MappingProxyType(
    {"us": "µs", "um": "µm", "uN": "µN", "uA": "µA", "C": "°C", "pct": "%", "1": "no unit (part)",
     AT_CARD: "V at the card"}
)  # fmt: skip
#: What the window calls the options that a text of an import is about.
LABELS = MappingProxyType(
    {
        "column": "“Quantity” and “Scale”",
        "table": "“Table”",
        "names_line": "“Names in line”",
        "rate_Hz": "“Rate”",
        "skip_bad_rows": "“Leave out bad rows”",
        "gauge_length_mm": "“Gauge length”",
        "area_mm2": "“Cross-section”",
        "kinematics": "“Kinematics”",
    }
    | dict.fromkeys(
        ("rig_file", "film_length_mm", "film_width_mm", "film_thickness_um", "permittivity",
         "load_g"),
        "“Film and load”",
    )
)  # fmt: skip


@dataclass(frozen=True)
class ColumnChoice:
    """Choice for one column; ``quantity`` is "" where it is not used, ``unit`` where it is open.

    Values are taken as cell * scale + offset, in ``unit``; None where nothing was typed.
    """

    quantity: str = ""
    unit: str = ""
    scale: float | None = None
    offset: float | None = None


def quantity_label(quantity: str) -> str:
    """Return ``quantity`` as it is shown."""
    return quantity.replace("_", " ").capitalize()


def unit_label(unit: str) -> str:
    """Return ``unit`` as it is shown."""
    return _UNIT_LABELS.get(unit, unit)


def units_of(quantity: str, raw: bool) -> list[str]:
    """Return the units that ``quantity`` may have; ``raw``: volts at the card too."""
    units = list(UNITS[DIMENSIONS[quantity]])
    return [*units, AT_CARD] if raw and quantity in RAW.values() else units


def first_choices(proposal: ColumnGuesses) -> dict[int, ColumnChoice]:
    """Return the choices that are sure; what is a guess is left open."""
    found = {}
    for number, guess in proposal.guesses.items():
        if guess.doubt != "column":
            found[number] = ColumnChoice(guess.quantity, AT_CARD if guess.raw else guess.unit)
    return found


def kind_of(choices: Mapping[int, ColumnChoice]) -> str:
    """Return the kind of recording that ``choices`` make: actuator, film, or ""."""
    there = {choice.quantity for choice in choices.values()}
    if there & {"voltage", "voltage_monitor"}:
        return "actuator"
    return "film" if there & {"stretch", "strain", "nominal_stress", "force"} else ""


def problems(
    choices: Mapping[int, ColumnChoice],
    columns: Sequence[ColumnPreview],
    guesses: Mapping[int, Guessed],
) -> list[str]:
    """Return what is missing or contradictory in ``choices``, as sentences."""
    found = []
    by_number = {column.number: column for column in columns}
    used: dict[str, str] = {}
    for number, choice in choices.items():
        if not choice.quantity:
            continue
        column = by_number[number]
        if choice.quantity in used:
            found.append(
                f"{quantity_label(choice.quantity)} is chosen for {used[choice.quantity]!r} and "
                f"for {column.name!r}: choose one."
            )
        used[choice.quantity] = column.name
        guess = guesses.get(number)
        if not choice.unit:
            scaled = guess is not None and guess.doubt == "scale"
            more = f", which is in {column.unit}, and enter its scale"
            found.append(f"Choose the unit of {column.name!r}{more if scaled else ''}.")
            continue
        if (said := _contradiction(choice, column, guess)) is not None:
            found.append(said)
    if not kind_of(choices):
        found.append("Choose the columns: voltage and displacement, or stretch and stress.")
    return found


def _contradiction(
    choice: ColumnChoice, column: ColumnPreview, guess: Guessed | None
) -> str | None:
    """Return why the unit that is chosen needs a scale; None if it does not."""
    if choice.scale is not None or choice.unit == AT_CARD:
        return None
    chosen, named = unit_label(choice.unit), unit_label(column.unit)
    if guess is not None and guess.doubt == "scale" and guess.quantity == choice.quantity:
        card = ", or choose V at the card with a rig file" if column.unit == "V" else ""
        return f"{column.name!r} is in {named}: enter its scale in {chosen} per {named}{card}."
    known = any(column.unit in units for units in UNITS.values())
    if known and column.unit != choice.unit:
        right = (
            f"choose {named}, or enter a scale (1 if the name is wrong)"
            if column.unit in UNITS[DIMENSIONS[choice.quantity]]
            else f"enter its scale in {chosen} per {named}"
        )
        return f"{column.name!r} is in {named} by its name, and {chosen} is chosen: {right}."
    return None


def columns_option(
    choices: Mapping[int, ColumnChoice], columns: Sequence[ColumnPreview]
) -> dict[str, str]:
    """Return ``ImportOptions.columns`` for ``choices`` without ``problems``."""
    names = {column.number: column.name for column in columns}
    found = {}
    for number, choice in choices.items():
        if not choice.quantity:
            continue
        target = (
            f"{choice.quantity}_{AT_CARD}"
            if choice.unit == AT_CARD
            else target_name(choice.quantity, choice.unit)
        )
        source = names[number]
        if choice.scale is not None or choice.offset is not None:
            scale = 1.0 if choice.scale is None else choice.scale
            # by its number: a name with a scale behind it may be another column's name
            source = f"#{number}*{scale!r}" + (f"{choice.offset:+}" if choice.offset else "")
        found[target] = source
    return found


def with_labels(text: str | DearigError, path: Path | None = None) -> str:
    """Return a text of the import with the labels of the fields that it is about.

    The file at ``path``, which is shown already, is not named again.
    """
    shown = str(text)
    if path is not None:
        shown = shown.replace(f"{path}, ", "").replace(f"{path}: ", "")
        shown = shown.replace(f"{path} ", "the file ")
        shown = shown[:1].upper() + shown[1:]
    options = (option for hint in hints_of(text) for option in hint.options)
    labels = dict.fromkeys(LABELS[option] for option in options if option in LABELS)
    return f"{shown} ({', '.join(labels)})" if labels else shown
