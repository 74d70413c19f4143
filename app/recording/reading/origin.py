"""Origin of a recording: rig, seed, operator, film and hashes, as a report names them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dearig.errors import InputError
from dearig.recording.content.provenance import is_start_known
from dearig.recording.content.timestamps import local_time
from dearig.recording.reading.reader import open_recording

if TYPE_CHECKING:
    from dearig.recording.reading.recording import Recording

__all__ = ["HASHED_MAX", "MODEL", "Origin", "origin_of", "origins_of_files"]

#: Key in the provenance of a prediction: the name of the model that made it.
MODEL = "model"
#: Bytes of recordings that are hashed for a report, at most: SHA-256 takes a second for each GB.
HASHED_MAX = 4 * 2**30


@dataclass(frozen=True)
class Origin:
    """Origin of the recording ``name``; a text that is empty was not recorded.

    ``simulated`` is None where nothing says so, as for imported data. ``source`` is the rig's
    address, the model, or the imported file; ``seed`` is that of the simulated noise. ``film`` has
    the name and the size of the film. ``rig_file`` is the SHA-256 of the rig file's text, or says
    that the run had none. ``sha256`` is that of the recording's file, "" where it was not computed.
    """

    name: str
    sha256: str = ""
    simulated: bool | None = None
    source: str = ""
    seed: int | None = None
    started: str = ""
    operator: str = ""
    film: str = ""
    rig_file: str = ""


def origin_of(recording: Recording, hashed: bool = True) -> Origin:
    """Return the origin of ``recording``; not ``hashed`` leaves out the hash of its file."""
    noted = recording.provenance
    simulated, seed = noted.get("simulated"), noted.get("seed")
    return Origin(
        name=recording.name,
        sha256=recording.sha256 if hashed else "",
        simulated=simulated if isinstance(simulated, bool) else None,
        source=_source(noted),
        seed=seed if isinstance(seed, int) and not isinstance(seed, bool) else None,
        started=local_time(str(noted.get("start_time", ""))) if is_start_known(noted) else "",
        operator=str(noted.get("operator", "")),
        film=_film(recording),
        rig_file=_rig_file(noted),
    )


def _source(noted: Mapping[str, object]) -> str:
    if model := noted.get(MODEL):
        return f"prediction of the model {model}"
    rig, imported = str(noted.get("rig", "")), str(noted.get("source", ""))
    words = [f"rig {rig}" if rig else "", f"imported from {imported}" if imported else ""]
    return ", ".join(word for word in words if word)


def _film(recording: Recording) -> str:
    film = recording.film
    words = [recording.film_id]
    if film is not None:
        sides = (film.length, film.width, film.thickness)
        words.append(" x ".join(f"{side * 1e3:.4g}" for side in sides) + " mm")
    return ", ".join(word for word in words if word)


def _rig_file(noted: Mapping[str, object]) -> str:
    if not noted.get("rig") or noted.get("source"):
        return ""  # imported data have none
    if not noted.get("configuration"):
        return "none, the default rig"
    return str(noted.get("configuration_sha256", ""))


def origins_of_files(paths: Iterable[Path]) -> tuple[Origin, ...]:
    """Return the origins of the recordings at ``paths``, those that can be read.

    Their files are hashed unless they have more than ``HASHED_MAX`` bytes together.
    """
    files = [path for path in dict.fromkeys(paths) if path.is_file()]
    hashed = sum(path.stat().st_size for path in files) <= HASHED_MAX
    found = []
    for path in files:
        try:
            found.append(origin_of(open_recording(path), hashed))
        except InputError:
            found.append(Origin(path.name))  # the report says itself which runs are lost
    return tuple(found)
