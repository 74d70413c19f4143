"""Quantities of columns, by names in the languages of many laboratories.

``voltage_kV`` is the name that this program gives a voltage in kV: the quantity and the unit.
Files of other programs call it ``Voltage [kV]``, ``Spannung / kV`` or ``Tension (kV)``.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType

from dearig.errors import InputError
from dearig.recording.importers.quantities.qualifiers import (
    COMPRESSIVE,
    TRUE,
    is_harmful,
    is_harmless,
    qualifier_in,
)
from dearig.recording.importers.quantities.units import UNITS, WIDE_BRACKETS, UnitScale, unit_of

__all__ = [
    "DIMENSIONS",
    "Label",
    "Target",
    "has_east_asian_name",
    "label_of",
    "names_of",
    "suggestion",
    "target_name",
    "target_of",
]

#: Dimension of each quantity that a recording is made of.
DIMENSIONS = MappingProxyType(
    {
        "time": "time",
        "voltage": "voltage",
        "voltage_monitor": "voltage",
        "current": "current",
        "displacement": "length",
        "temperature": "temperature",
        "stretch": "stretch",
        "strain": "strain",
        "true_strain": "strain",
        "nominal_stress": "stress",
        "true_stress": "stress",
        "force": "force",
    }
)


def _plain(text: str) -> str:
    """Return ``text`` in small letters without accents."""
    apart = unicodedata.normalize("NFKD", text.casefold())
    return "".join(c for c in apart if not unicodedata.combining(c))


#: Words of a name, without accents and in small letters, by quantity. A name that is written
#: together, such as Standardkraft, counts by its end.
_WORDS = MappingProxyType(
    {
        "time": "time zeit temps timestamp timestamps zeitstempel datetime elapsed t tiempo tempo "
        "tijd tid czas cas prufdauer versuchsdauer messdauer время",
        "voltage_monitor": "monitor moniteur vmon",
        "voltage": "voltage volt volts spannung tension hv highvoltage hochspannung u v potential "
        "potentiel voltaje tensione tensao spanning napiecie napeti напряжение",
        "current": "current curr strom courant i imon leakage corriente corrente stroom prad ток",
        "temperature": "temperature temperatur temp temperatura temperatuur teplota температура",
        "stretch": "stretch lambda λ streckung streckgrad",
        "strain": "strain dehnung deformation verformung compression stauchung deformacion "
        "deformazione deformacao rek деформация",
        "nominal_stress": "stress contrainte spannung zugspannung nennspannung esfuerzo sforzo "
        "напряжение",
        "force": "force load kraft last charge effort f tension fuerza forza forca kracht siła "
        "sila сила",
        "displacement": "displacement disp displ deflection lvdt travel extension weg verschiebung "
        "deplacement stroke hub position elongation auslenkung langenanderung allongement "
        "verlangerung laser crosshead traverse course dehnung compression stauchung "
        "desplazamiento spostamento deslocamento verplaatsing forskjutning przemieszczenie "
        "posunuti перемещение",
    }
)
_QUANTITIES_OF: dict[str, list[str]] = {}
for _quantity, _names in _WORDS.items():
    for _word in _names.split():
        _QUANTITIES_OF.setdefault(_word, []).append(_quantity)
#: Ends of German names that are written together.
_ENDS = (
    "kraft", "spannung", "weg", "zeit", "dehnung", "strom", "verschiebung", "temperatur",
    "position",
)  # fmt: skip

#: Ends of Chinese and Japanese names, by quantity; what ends another one is after it.
_EAST_ASIAN = MappingProxyType(
    {
        "time": "时间 時間 时刻 時刻",
        "voltage_monitor": "电压监测 電圧モニタ",
        "voltage": "电压 電圧 電壓",
        "current": "电流 電流",
        "temperature": "温度 溫度",
        "stretch": "伸长比 拉伸比 伸張比",
        "strain": "应变 應變 ひずみ 歪み 伸长率",
        "nominal_stress": "应力 応力 應力",
        "displacement": "位移 変位 伸长 伸長 伸び 行程 ストローク",
        "force": "载荷 负荷 荷重 荷载 力值 试验力 試験力 拉力 力",
    }
)
_EAST_ASIAN_ENDS = tuple(
    (_plain(end), quantity) for quantity, ends in _EAST_ASIAN.items() for end in ends.split()
)
#: Ends of a pressure, which is not a force.
_EAST_ASIAN_OTHERS = ("压力", "圧力", "壓力")

#: Words of a quantity of another kind: a speed is not travel.
_OTHERS = frozenset(
    re.findall(
        r"\w+",
        """rate speed velocity geschwindigkeit vitesse limit power energie energy work arbeit nr no
        number cycle zyklus cycles thickness dicke width breite area flache diameter durchmesser
        gap""",
    )
)
#: Quantities that refer to the film as it is strained, by those that refer to it at rest.
_TRUE_OF = MappingProxyType({"strain": "true_strain", "nominal_stress": "true_stress"})


@dataclass(frozen=True)
class Label:
    """What a column's name says: quantities that it may be, and its unit, empty if it has none.

    ``unit`` is a symbol of ``UNITS``, ``dimensions`` are those that the symbol belongs to. ``raw``
    is the quantity of an instrument's output in volts, such as a laser's. ``unknown`` is what
    seems to be a unit and is none of ``UNITS``.

    ``asked`` are quantities that the column may be although its word ``qualifier`` leaves it open:
    "desired displacement". ``conflict`` is a unit that the file gives next to the name and that is
    another one than the name's. ``compressive``: its positive values mean compression.
    ``unexplained`` is a word of a name without a quantity that is not known.
    """

    name: str
    quantities: tuple[str, ...] = ()
    unit: str = ""
    dimensions: tuple[str, ...] = ()
    raw: str = ""
    unknown: str = ""
    asked: tuple[str, ...] = ()
    qualifier: str = ""
    conflict: str = ""
    compressive: bool = False
    unexplained: str = ""


@dataclass(frozen=True)
class Target:
    """A column of a recording as it is asked for: a quantity and the unit of the source.

    ``raw`` columns are volts at the card's inputs, which the rig file's scaling converts.
    """

    name: str
    quantity: str
    unit: str
    raw: bool = False

    @property
    def scale(self) -> UnitScale:
        """Scale to the unit of the recording."""
        return UNITS[DIMENSIONS[self.quantity]][self.unit]


#: Name of a column whose values are volts at the card, by quantity.
RAW = MappingProxyType(
    {"displacement_raw_V": "displacement", "voltage_raw_V": "voltage",
     "voltage_monitor_raw_V": "voltage_monitor", "current_raw_V": "current"}
)  # fmt: skip


def target_of(name: str) -> Target:
    """Return the target called ``name``. Raises ``InputError`` for a name that none has."""
    if name in RAW:
        return Target(name, RAW[name], "V", raw=True)
    for quantity, dimension in DIMENSIONS.items():
        units = UNITS[dimension]
        if "1" in units and name == quantity:
            return Target(name, quantity, "1")
        if name.startswith(f"{quantity}_") and name.removeprefix(f"{quantity}_") in units:
            return Target(name, quantity, name.removeprefix(f"{quantity}_"))
    like = next((q for q in sorted(DIMENSIONS, key=len, reverse=True) if name.startswith(q)), "")
    hint = (
        f": {like} may be {names_of(like)}"
        if like
        else suggestion([name], [target_name(q, u) for q in DIMENSIONS for u in _units(q)])
    )
    raise InputError(
        f"{name!r} is not a column of a recording{hint}; a name is a quantity and its unit, such "
        f"as voltage_kV; quantities are {', '.join(DIMENSIONS)}"
    )


def target_name(quantity: str, unit: str) -> str:
    """Return the name of the target of ``quantity`` in ``unit``."""
    return quantity if unit == "1" else f"{quantity}_{unit}"


def _units(quantity: str) -> list[str]:
    return list(UNITS[DIMENSIONS[quantity]])


def names_of(quantity: str) -> str:
    """Return the names that a column of ``quantity`` may have, for a message."""
    return ", ".join(target_name(quantity, unit) for unit in _units(quantity))


#: Units that a name may end with as the letter of a channel.
_LETTERS = frozenset("ACFKNVms")


def label_of(name: str, unit: str = "") -> Label:
    """Return what the column ``name`` says; ``unit`` is what the file says of it elsewhere."""
    words, found = name, unit_of(unit) if unit else None
    bracketed = name.strip().translate(_BRACKETS)
    inside = [text for text in _IN_BRACKETS.findall(bracketed) if unit_of(text)]
    if len(inside) > 1:  # a number next to a unit counts: Force (1) [N]
        inside = [text for text in inside if text.strip() != "1"]
    if len(inside) == 1:
        words, found = bracketed.replace(f"[{inside[0]}]", " "), unit_of(inside[0])
    for pattern in () if inside else _UNIT_IN_NAME:
        match = pattern.fullmatch(bracketed)
        if match and "[" not in match["name"] and (known := unit_of(match["unit"])):
            if match["unit"] == "1" and _read(match["name"]).quantities[:1] != ["strain"]:
                continue  # a number
            if found and match["unit"] in _LETTERS and not _read(match["name"]).quantities:
                break  # Channel A, in V
            words, found = match["name"], known
            break
    symbol, dimensions = found or ("", ())
    of_unit = unit_of(unit) if unit else None
    conflict = ""
    if found and unit and (of_unit is None or of_unit[0] != symbol):
        conflict = of_unit[0] if of_unit else unit
    unknown = "" if found else unit or _unknown_unit(name)
    said = _read(words)
    quantities, raw = said.quantities, ""
    if found:
        # the output of a laser or of a monitor in volts is not a voltage at the film
        raw = next((q for q in quantities if dimensions == ("voltage",) and q in _RAW), "")
        if raw and raw != "voltage_monitor":
            quantities = []
        if symbol == "pct" and _LENGTHENING.intersection(_words_of(words)):
            quantities = ["strain"] if quantities == ["displacement"] else quantities
        quantities = [q for q in quantities if DIMENSIONS[q] in dimensions]
    asked = [q for q in said.asked if not found or DIMENSIONS[q] in dimensions]
    qualifier = said.qualifier
    less_one = _LESS_ONE if "stretch" in quantities else _COMPUTED
    without_unit = words if found else _IN_BRACKETS.sub(" ", bracketed)
    if match := _COMPUTED.search(without_unit) or less_one.search(without_unit):
        asked, qualifier = list(dict.fromkeys([*quantities, *asked])), match[0].strip()
    if asked:  # the word counts for the column, whichever of its words is the quantity
        quantities, raw = [], ""
    unexplained = "" if quantities or asked or raw else said.unexplained
    return Label(
        name, tuple(quantities), symbol, dimensions, raw, unknown, tuple(asked), qualifier,
        conflict, said.compressive, unexplained,
    )  # fmt: skip


#: What says that the values of a column were computed from the quantity in its name: *1000, /2,
#: d(x)/dt, log10, a square, a sign, peak to peak, a size, the second Piola-Kirchhoff
#: stress.
_COMPUTED = re.compile(
    r"[*\N{MULTIPLICATION SIGN}\N{MIDDLE DOT}]\s*[\d.]+|\b[xX]\s?\d{2,}|/\s*\d+(?:\.\d+)?\s*$"
    r"|\^|[\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}\N{SQUARE ROOT}\N{PARTIAL DIFFERENTIAL}]"
    r"|^\s*[-\N{MINUS SIGN}]\s*(?=[^\W\d])|\bd\s*\[|/\s*dt\b|\blog\s?\d+|\b[pP]-[pP]\b"
    r"|\b2(?:nd|\.)?\s*PK\b|\|[^|]+\|"
)


#: A stretch minus 1 is a strain; behind another name the 1 is a number.
_LESS_ONE = re.compile(r"[-\N{MINUS SIGN}]\s*1\s*$")
#: Words of a displacement that in % is a part of the length; a stroke in % is one of its range.
_LENGTHENING = frozenset(
    ["elongation", "extension", "allongement", "verlangerung", "langenanderung", "alargamiento"]
)


def _unknown_unit(name: str) -> str:
    """Return a short text in brackets at the end of ``name``, which may be a unit, or ""."""
    bracketed = name.strip().translate(_BRACKETS)
    found = _IN_BRACKETS.findall(bracketed) if bracketed.endswith("]") else []
    inside = found[-1].strip() if found else ""
    return inside if len(inside) <= UNIT_MAX and _UNIT_LIKE.match(inside) else ""


#: What begins as a unit does: a letter, or a factor before one, as in 0.01 mm.
_UNIT_LIKE = re.compile(r"[^\W\d]|[°%\N{PER MILLE SIGN}]|[xX*\d.^+-]+\s*[^\W\d]")


#: Characters of a unit, at most: (measured) is none.
UNIT_MAX = 7
_RAW = ("displacement", "current", "voltage_monitor")
_BRACKETS = str.maketrans(f"(){WIDE_BRACKETS}", "[][]")
_IN_BRACKETS = re.compile(r"\[([^\[\]]+)\]")
_UNIT_IN_NAME = (
    re.compile(r"(?P<name>.*\S)\s*,\s*(?P<unit>\S+)"),
    re.compile(r"(?P<name>.*\S)\s+in\s+(?P<unit>\S+)"),
    re.compile(r"(?P<name>.*[^\s/])\s*/\s*(?P<unit>\S+)"),
    re.compile(r"(?P<name>.*[^_.\s])[_.\s]+(?P<unit>[^_.\s]+)"),
)


@dataclass(frozen=True)
class _Said:
    """What the words of a name say: quantities, those that it leaves open, and by which word.

    ``unexplained`` is the first word that is not known.
    """

    quantities: list[str]
    asked: list[str]
    qualifier: str
    compressive: bool = False
    unexplained: str = ""


def _words_of(name: str) -> list[str]:
    """Return the words of ``name`` without accents, in small letters.

    StandardForce is two words; so is Standardkraft, whose end names the quantity.
    """
    found: list[str] = []
    for word in re.findall(r"[^\W\d_]+", _plain(_CAMEL.sub(" ", name))):
        end = "" if word in _QUANTITIES_OF else next((e for e in _ENDS if word.endswith(e)), "")
        found += [word[: -len(end)], end] if end and word != end else [word]
    return found


#: The place between two words that are written together, each with a capital letter.
_CAMEL = re.compile(r"(?<=[a-z]{2})(?=[A-Z][a-z]{2})")


def _read(name: str) -> _Said:
    """Return what the words of ``name`` say."""
    words = _words_of(name)
    qualifier = next(filter(is_harmful, words), "")
    if other := next((word for word in words if word in _OTHERS), ""):
        return _Said([], [], qualifier or other)
    places: dict[int, list[str]] = {}
    for place, word in enumerate(words):
        known = _QUANTITIES_OF.get(word) or _east_asian(word)
        if known and (len(word) > 1 or len(words) == 1):  # a letter among words is an index
            places[place] = known
    if not COMPRESSIVE.issuperset(words[place] for place in places):  # compression load is a load
        places = {p: known for p, known in places.items() if words[p] not in COMPRESSIVE}
    sure: list[str] = []
    asked: list[str] = []
    for place, known in places.items():
        others = [w if at == place or at not in places else "" for at, w in enumerate(words)]
        open_by = {q: qualifier_in(q, others, place) for q in known}
        if is_harmful(words[place]):  # of a Chinese or Japanese name, which has no blanks
            open_by = dict.fromkeys(known, words[place])
        free = [q for q, word in open_by.items() if not word]
        sure += free
        if not free:
            asked += known
            qualifier = qualifier or next(iter(open_by.values()))
    if TRUE.intersection(words):
        sure = [_TRUE_OF[q] for q in sure if q in _TRUE_OF]
    sure, asked = list(dict.fromkeys(sure)), list(dict.fromkeys(asked))
    if "voltage_monitor" in sure:  # of the voltage, unless its name says of what
        sure = [q for q in sure if q in ("current", "displacement")] or ["voltage_monitor"]
    strange = next((w for at, w in enumerate(words) if at not in places and not is_harmless(w)), "")
    return _Said(sure, asked, qualifier, bool(COMPRESSIVE.intersection(words)), strange)


def _east_asian(word: str) -> list[str]:
    """Return the quantity of a Chinese or Japanese name without accents, as a list."""
    if word.endswith(_EAST_ASIAN_OTHERS):
        return []
    return [quantity for end, quantity in _EAST_ASIAN_ENDS if word.endswith(end)][:1]


def has_east_asian_name(text: str) -> bool:
    """Return whether ``text`` has a Chinese or Japanese name of a quantity, of two characters."""
    ends = (end for ends in _EAST_ASIAN.values() for end in ends.split())
    return any(len(end) > 1 and end in text for end in ends)


def suggestion(wanted: Iterable[str], there: Iterable[str]) -> str:
    """Return ``; did you mean 'x'?`` for the name ``there`` nearest to one ``wanted``, or ""."""
    listed = list(there)
    lowered = {name.lower(): name for name in reversed(listed)}
    for name in wanted:
        near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.6)
        if near:
            return f"; did you mean {lowered[near[0]]!r}?"
    return ""
