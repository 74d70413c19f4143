"""Head of every report: what made it, from which recordings, and whether these are simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dearig.report.made import made, made_now
from dearig.report.text.citation import citation

if TYPE_CHECKING:
    from dearig.analysis.outcomes import Comparison
    from dearig.recording.reading.origin import Origin

__all__ = [
    "NOT_RECORDED",
    "Head",
    "RecordingLine",
    "head_of",
    "origins_of",
    "simulated_text",
]

#: What is said of a value that no recording has.
NOT_RECORDED = "not recorded"

#: Recordings that are listed in the open; more are folded.
_LISTED_MAX = 6


@dataclass(frozen=True)
class RecordingLine:
    """A recording in the head: its name, what is known of it, and the hash of its file."""

    name: str
    about: str
    sha256: str


@dataclass(frozen=True)
class Head:
    """Head of a report: ``banner`` is "" for data that are not simulated, ``rows`` name values."""

    banner: str
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    recordings: tuple[RecordingLine, ...]

    @property
    def is_folded(self) -> bool:
        """True if there are so many recordings that their list is folded."""
        return len(self.recordings) > _LISTED_MAX


def head_of(origins: Iterable[Origin], rows: Sequence[tuple[str, Sequence[str]]] = ()) -> Head:
    """Return the head of a report on the recordings of ``origins``.

    ``rows`` are names with values that replace those of the recordings, such as a film that is
    known from elsewhere, or follow them.
    """
    origins = tuple(dict.fromkeys(origins))
    given = {name: tuple(values) for name, values in rows}
    now, first = made_now(), made()
    by = first or now
    found: dict[str, tuple[str, ...]] = {
        "Program": (by.program,),
        "Report made": (by.time,),
        "Command": (by.command,),
        "Film": _distinct(origins, lambda o: o.film),
        "Operator": _distinct(origins, lambda o: o.operator),
        "Rig file (SHA-256)": _distinct(origins, lambda o: o.rig_file),
    }
    if first is not None:
        found["Made again"] = (now.time, f"by {now.program}", now.command)
    found["Cite as"] = citation(by.program)
    lines = tuple(RecordingLine(o.name, _about(o), o.sha256 or "not computed") for o in origins)
    return Head(simulated_text(origins), tuple((found | given).items()), lines)


def origins_of(comparisons: Iterable[Comparison]) -> tuple[Origin, ...]:
    """Return the origin of each recording, with its name alone where nothing else is known."""
    from dearig.recording.reading.origin import Origin  # imports h5py

    return tuple(Origin(c.name) if c.origin is None else c.origin for c in comparisons)


def simulated_text(origins: Sequence[Origin]) -> str:
    """Return which recordings are simulated, with rigs and seeds; "" where none is."""
    made = [o for o in origins if o.simulated]
    if not made:
        return ""
    by_source: dict[str, list[int]] = {}
    for origin in made:
        seeds = by_source.setdefault(origin.source or "a simulated rig", [])
        if origin.seed is not None and origin.seed not in seeds:
            seeds.append(origin.seed)
    sources = "; ".join(f"{source}{_seeds(seeds)}" for source, seeds in by_source.items())
    if len(made) == len(origins):
        what = "no measured data"
    else:
        what = f"{len(made)} of {len(origins)} recordings: {', '.join(o.name for o in made)}"
    return f"{what} ({sources})"


def _seeds(seeds: Sequence[int]) -> str:
    """Return the seeds of the noise of one source, as words that follow it."""
    if not seeds:
        return ""
    ordered = sorted(seeds)
    run = ordered == list(range(ordered[0], ordered[0] + len(ordered)))
    if len(ordered) == 1:
        return f", noise seed {ordered[0]}"
    if run:
        return f", noise seeds {ordered[0]} to {ordered[-1]}"
    return f", noise seeds {', '.join(map(str, ordered))}"


def _distinct(origins: Sequence[Origin], value: Callable[[Origin], str]) -> tuple[str, ...]:
    """Return the different values of the recordings, with their names where they differ."""
    found: dict[str, list[str]] = {}
    for origin in origins:
        found.setdefault(value(origin) or NOT_RECORDED, []).append(origin.name)
    if len(found) < 2:
        return tuple(found) or (NOT_RECORDED,)
    return tuple(
        f"{text} ({', '.join(names) if len(names) <= _LISTED_MAX else f'{len(names)} recordings'})"
        for text, names in found.items()
    )


def _about(origin: Origin) -> str:
    """Return source and time of a recording in a few words."""
    kind = {True: "simulated", False: "measured", None: ""}[origin.simulated]
    seed = "" if origin.seed is None else f"noise seed {origin.seed}"
    words = [kind, origin.source, seed, origin.started]
    return ", ".join(word for word in words if word) or f"source {NOT_RECORDED}"
