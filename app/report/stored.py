"""Results inside reports and JSON files, from which reports and figures are made again.

A text holds the outcomes and what made them. It is the Base64 form of a compressed document: one
line of JSON, and the arrays that it refers to by their number. Types come from the annotations of
the outcomes: a document names none, so that it can create nothing else.
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import json
import re
import types
import typing
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from dearig.analysis.outcomes import DiagnoseOutcome, IdentifyOutcome, ValidateOutcome
from dearig.errors import DearigError, InputError
from dearig.input_file import parse_json
from dearig.report.made import Made

__all__ = ["FORMAT", "Outcome", "StoredReport", "restored", "stored", "stored_in", "stored_url"]

FORMAT = "dearig-report/1"

Outcome = IdentifyOutcome | ValidateOutcome | DiagnoseOutcome
_KINDS: Mapping[str, type[Outcome]] = types.MappingProxyType(
    {
        "identification": IdentifyOutcome,
        "validation": ValidateOutcome,
        "diagnosis": DiagnoseOutcome,
    }
)
_URL = "data:application/json,"
#: Bytes of an uncompressed document, at most: a diagnosis of ten recordings of an hour has a tenth.
_LARGEST = 2**31
#: JSON has no such numbers.
_NOT_FINITE = types.MappingProxyType(
    {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}
)


@dataclass(frozen=True)
class StoredReport:
    """Outcomes of one report, in the order of its parts, and what ``made`` them."""

    outcomes: tuple[Outcome, ...]
    made: Made


def stored(outcomes: Sequence[Outcome], made: Made) -> str:
    """Return ``outcomes`` and what ``made`` them as a text of ASCII characters."""
    arrays = _Arrays()
    names = {kind: name for name, kind in _KINDS.items()}
    document = {
        "format": FORMAT,
        "made": _plain(made, arrays),
        "outcomes": [{"kind": names[type(o)], "value": _plain(o, arrays)} for o in outcomes],
        "arrays": arrays.heads,
    }
    head = json.dumps(document, allow_nan=False, separators=(",", ":")).encode("ascii")
    packed = zlib.compress(b"\n".join([head, b"".join(arrays.parts)]))
    return base64.b64encode(packed).decode("ascii")


def restored(text: str, name: str) -> StoredReport:
    """Return what ``stored`` has written. Raises ``InputError`` with the ``name`` of its file."""
    try:
        document, arrays = _opened(text, name)
        outcomes = tuple(
            _value(_KINDS[o["kind"]], o["value"], arrays) for o in document["outcomes"]
        )
        if not outcomes:
            raise ValueError("no result")  # noqa: TRY301  (it is reported as all others are)
        return StoredReport(outcomes, _value(Made, document["made"], []))
    except InputError:
        raise
    except (
        binascii.Error, zlib.error, ArithmeticError, DearigError, LookupError, TypeError, ValueError
    ) as error:  # fmt: skip
        raise InputError(
            f"{name} holds no result that this version of dearig can read ({_short(error)}); the "
            f"version that wrote it can"
        ) from error


def stored_url(text: str) -> str:
    """Return the address that holds what ``stored`` has returned, as a file of JSON."""
    return f"{_URL}{quote(json.dumps({'format': FORMAT, 'report': text}), safe='+/=')}"


def stored_in(page: str) -> str | None:
    """Return what ``stored`` has returned from a page with ``stored_url``; None without one."""
    found = re.search(rf'href="{re.escape(_URL)}([^"]*)"', page)
    if found is None:
        return None
    held = parse_json(unquote(found[1]))
    return str(held["report"])


def _opened(text: str, name: str) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Return the document in ``text`` and its arrays."""
    unpacker = zlib.decompressobj()
    raw = unpacker.decompress(base64.b64decode(text, validate=True), _LARGEST)
    if unpacker.unconsumed_tail or not unpacker.eof:
        raise InputError(f"{name}: the result in it is incomplete or too large")
    head, _, rest = raw.partition(b"\n")
    document = parse_json(head)
    if document["format"] != FORMAT:
        raise InputError(
            f"{name} has the format {str(document['format'])[:40]!r}; this version of dearig "
            f"reads {FORMAT}"
        )
    return document, _unpacked(document["arrays"], rest)


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:200]


# ---------------------------------------------------------------- arrays


class _Arrays:
    """Arrays of a document, each once: recordings share their times."""

    def __init__(self) -> None:
        self.heads: list[list[Any]] = []
        self.parts: list[bytes] = []
        self._known: dict[tuple[str, tuple[int, ...], bytes], int] = {}

    def number(self, array: np.ndarray) -> int:
        """Return the number of ``array``, which is added unless it is there."""
        if array.dtype.kind not in "fiub":
            raise TypeError(f"an array of {array.dtype} cannot be stored")
        plain = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
        # bytes of the same place in all numbers together: neighbours are alike, and compress
        shuffled = plain.reshape(-1, 1).view(np.uint8).T.tobytes() if plain.size else b""
        key = (plain.dtype.str, plain.shape, shuffled)
        if key not in self._known:
            self._known[key] = len(self.heads)
            self.heads.append([plain.dtype.str, *plain.shape])
            self.parts.append(shuffled)
        return self._known[key]


def _unpacked(heads: Sequence[Sequence[Any]], raw: bytes) -> list[np.ndarray]:
    found, at = [], 0
    for text, *shape in heads:
        dtype = np.dtype(text)
        if dtype.kind not in "fiub" or any(type(n) is not int or n < 0 for n in shape):
            raise ValueError("an array of another kind")
        count = int(np.prod(shape, dtype=np.int64)) if shape else 1
        size = count * dtype.itemsize
        part = np.frombuffer(raw, np.uint8, size, at) if size else np.zeros(0, np.uint8)
        numbers = np.ascontiguousarray(part.reshape(dtype.itemsize, count).T).view(dtype)
        found.append(numbers.reshape(shape))
        at += size
    return found


# ---------------------------------------------------------------- values


def _plain(value: Any, arrays: _Arrays) -> Any:
    """Return ``value`` as JSON has it."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {f.name: _plain(getattr(value, f.name), arrays) for f in dataclasses.fields(value)}
        # an annotation may allow several classes
        return {"": type(value).__name__, **fields}
    if isinstance(value, np.ndarray):
        return {"array": arrays.number(value)}
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if np.isfinite(value) else {"number": str(value)}
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, DearigError):
        return {"error": str(value)}
    if isinstance(value, Mapping):
        return {"items": [[str(key), _plain(v, arrays)] for key, v in value.items()]}
    if isinstance(value, Sequence):
        return [_plain(v, arrays) for v in value]
    return {"text": str(value)}  # dates of a model's history


def _value(hint: Any, plain: Any, arrays: list[np.ndarray]) -> Any:
    """Return the value of the type ``hint`` for ``plain``. Raises ``TypeError`` if it is none."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        return _one_of(inner, plain, arrays)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _object(hint, plain, arrays)
    if hint is np.ndarray or origin is np.ndarray:
        return arrays[plain["array"]]
    if origin is tuple and isinstance(plain, list):
        hints = [inner[0]] * len(plain) if inner[-1] is Ellipsis else list(inner)
        return tuple(_value(h, p, arrays) for h, p in zip(hints, plain, strict=True))
    if hint is Any or origin in (Mapping, dict):
        return _any(plain)
    if hint is float and isinstance(plain, dict):
        return _NOT_FINITE[plain["number"]]
    if hint is float and type(plain) in (int, float):
        return plain
    if isinstance(hint, type) and issubclass(hint, DearigError):
        return DearigError(str(plain["error"]))
    if type(plain) is hint or (hint is types.NoneType and plain is None):
        return plain
    raise TypeError(f"{type(plain).__name__} where {hint} belongs")


def _one_of(hints: Sequence[Any], plain: Any, arrays: list[np.ndarray]) -> Any:
    if plain is None and types.NoneType in hints:
        return None
    left = [h for h in hints if h is not types.NoneType]
    if isinstance(plain, dict) and "" in plain:
        left = [h for h in left if getattr(h, "__name__", "") == plain[""]]
    if len(left) != 1:
        raise TypeError(f"{str(plain)[:40]} is none of {hints}")
    return _value(left[0], plain, arrays)


def _object(kind: type, plain: Any, arrays: list[np.ndarray]) -> Any:
    if not isinstance(plain, dict) or plain.get("") != kind.__name__:
        raise TypeError(f"no {kind.__name__}")
    hints = _hints(kind)
    given = {name: v for name, v in plain.items() if name}
    unknown = given.keys() - {f.name for f in dataclasses.fields(kind) if f.init}
    if unknown:
        raise TypeError(f"{kind.__name__} has no {min(unknown)}")
    return kind(**{name: _value(hints[name], v, arrays) for name, v in given.items()})


def _any(plain: Any) -> Any:
    """Return values of a model's history, which have no annotation."""
    if isinstance(plain, list):
        return [_any(v) for v in plain]
    if isinstance(plain, dict):
        if "items" in plain:
            return {str(key): _any(v) for key, v in plain["items"]}
        return _NOT_FINITE[plain["number"]] if "number" in plain else str(plain["text"])
    return plain


@cache
def _hints(kind: type) -> dict[str, Any]:
    """Return the annotations of ``kind``, with those names that only a type checker imports."""
    from dearig.analysis.readings import band
    from dearig.config import modelfile
    from dearig.model import fitting, residual
    from dearig.model.diagnosis import events, excitation, results
    from dearig.model.fitting import channels
    from dearig.model.readings import measures
    from dearig.recording.reading import early_end, origin

    names: dict[str, Any] = {}
    for module in (
        band, modelfile, fitting, channels, residual, events, excitation, results, measures,
        early_end, origin,
    ):  # fmt: skip
        names |= vars(module)
    return typing.get_type_hints(kind, localns=names)
