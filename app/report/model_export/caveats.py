"""What the fit of a model said against its numbers, which go with them to another program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dearig.config.modelfile import ModelFile
from dearig.model.fitting.rejection import REJECTED
from dearig.model.verdict import NOT_CONFIRMED, PARTLY_EXPLAINED, UNEXPLAINED
from dearig.report.text.numbers import to_ascii
from dearig.report.text.sentences import undetermined_names_text

__all__ = ["caveats"]

_REJECTS = (PARTLY_EXPLAINED, NOT_CONFIRMED, UNEXPLAINED)


def caveats(given: ModelFile) -> Iterator[str]:
    """Yield sentences in ASCII: the data reject the model, or do not determine its numbers."""
    history = given.history
    warned = any(w.startswith(REJECTED) for w in _listed(history, "warnings", str))
    if warned or history.get("verdict") in _REJECTS:
        yield (
            "The recordings that the model was fitted to reject it: they leave more than noise. "
            "Its intervals hold only if it were right."
        )
    weak = [
        str(e["name"])
        for e in _listed(history, "estimate", Mapping)
        if e.get("determined") is False and "name" in e and not _is_fixed(e)
    ]
    if weak:
        yield to_ascii(undetermined_names_text(weak))


def _listed(history: Mapping[str, Any], key: str, kind: type) -> list[Any]:
    """Return the members of a list that are of a ``kind``; a model file may hold anything."""
    found = history.get(key)
    return [one for one in found if isinstance(one, kind)] if isinstance(found, list) else []


def _is_fixed(estimate: Mapping[str, Any]) -> bool:
    stated = estimate.get("stated")
    return isinstance(stated, Mapping) and "fixed" in stated
