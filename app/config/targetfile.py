"""Target files: a displacement over time that the film should follow.

A target is a sequence file in millimetres from the loaded rest state: the same kinds of segment,
with ``amplitude_mm`` in place of ``amplitude_kV`` and ``displacement_mm`` in place of
``voltage_kV``. It is read as a sequence whose kilovolts are millimetres.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Literal

import numpy as np
import tomli_w

from dearig.config.segments import SEGMENT_KINDS, SegmentTable
from dearig.config.segments.waveform import Csv
from dearig.config.sequencefile import LoadedSequence, SequenceFault, read_sequence
from dearig.config.toml_input import parse_toml, read_text, shown
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.simulation.excitation import Sampled, Sequence

__all__ = [
    "EXAMPLE",
    "LoadedTarget",
    "as_millimetres",
    "load_target",
    "millimetre_key",
    "parse_target",
    "read_target",
    "target_kinds",
    "target_of",
]

_M = 1e-6  # m per V: a target is read as a sequence in which 1 kV means 1 mm

#: A target that the rig of the thesis can follow.
EXAMPLE = """\
# A target: the displacement from the loaded rest state that the film should follow, in mm.
# Segments are those of a sequence, with mm in place of kV. A target starts and ends at 0 mm. A film
# returns on its own, and no voltage pushes it: the last ramp is slow.
name = "sine about 0.4 mm"

[[segment]]
kind = "ramp"
to_mm = 0.4
duration_s = 2.0

[[segment]]
kind = "sine"
amplitude_mm = 0.1
frequency_Hz = 0.5
cycles = 4.0
offset_mm = 0.4

[[segment]]
kind = "ramp"
to_mm = 0.05
duration_s = 4.0

[[segment]]
kind = "ramp"
to_mm = 0.0
duration_s = 8.0
"""


class _Displacement(Csv):
    """Path from a CSV file in the target's folder, linear between its points."""

    columns: ClassVar[Mapping[str, float]] = {
        "displacement_mm": 1e-3 / _M,
        "displacement_um": 1e-6 / _M,
        "displacement_m": 1.0 / _M,
    }
    kind: Literal["csv"]


def target_kinds() -> Mapping[str, type[SegmentTable]]:
    """Return the kinds of segment by name; their keys are those of a sequence, in kilovolts."""
    return MappingProxyType({**SEGMENT_KINDS, "csv": _Displacement})


@dataclass(frozen=True)
class LoadedTarget:
    """A target by ``name``, and the ``toml`` text that is kept with what was made of it."""

    name: str
    toml: str
    sequence: LoadedSequence

    def sample(self, rate: float) -> tuple[np.ndarray, np.ndarray, int, int]:
        """Return time in s and displacement in m (N,) at ``rate`` Hz, and lead-in and tail.

        These two are counts of samples at rest. Raises ``InputError`` for a target that is too
        long, or too fast for the rate.
        """
        try:
            time, volts = self.sequence.sample(rate)
        except InputError as error:
            raise InputError(as_millimetres(str(error))) from error
        edges = self.sequence.sequence.boundaries
        lead_in = int(np.searchsorted(time, edges[0]))
        tail = time.size - int(np.searchsorted(time, edges[-1], side="right"))
        return time, volts * _M, lead_in, tail


def target_of(time: np.ndarray, displacement: np.ndarray, name: str = "target") -> LoadedTarget:
    """Return the target of ``displacement`` (N,) m at ``time`` (N,) s, with lines in between.

    Raises ``InputError`` for arrays that are not a path, or that do not start and end at 0.
    """
    try:
        path = Sampled(np.asarray(time), np.asarray(displacement, dtype=np.float64) / _M)
        sequence = Sequence(name, (path,), labels=("arrays",))
    except ModelError as error:
        said = as_millimetres(str(error)).replace("csv: ", "")
        raise InputError(f"target {name!r}: {said}") from error
    loaded = LoadedSequence(sequence, "", (0.0,), (0,))
    return LoadedTarget(name, f"# {path.times.size} points from Python\n", loaded)


def load_target(path: str | Path) -> LoadedTarget:
    """Return the target in the file ``path``, TOML or a table (CSV).

    Raises ``InputError`` with one sentence: file, segment, key, value, and what is allowed.
    """
    path = Path(path)
    if path.suffix.lower() in (".csv", ".txt", ".dat"):
        text = tomli_w.dumps({"name": path.stem, "segment": [{"kind": "csv", "file": path.name}]})
        return parse_target(text, f"target {path}", path.parent)
    return parse_target(read_text(path, "target"), f"target {path}", path.parent)


def parse_target(text: str, name: str, folder: Path) -> LoadedTarget:
    """Return the target in the TOML ``text``; ``name`` and ``folder`` as of a sequence."""
    loaded, faults = read_target(text, name, folder)
    if loaded is None:
        more = len(faults) - 1
        tail = f" ({more} more fault{'s' if more > 1 else ''} after that)" if more else ""
        raise InputError(f"{name}: {faults[0].sentence}{tail}")
    return loaded


def read_target(
    text: str, name: str, folder: Path
) -> tuple[LoadedTarget | None, tuple[SequenceFault, ...]]:
    """Return the target in the TOML ``text``, or None and all of its faults.

    Raises ``InputError`` for a text that is not TOML, or whose keys are voltages.
    """
    data = parse_toml(text, name)
    tables = data.get("segment")
    if isinstance(tables, list):
        data["segment"] = [_as_kilovolts(table, f"{name}: segment {i + 1}") for i, table in
                           enumerate(tables)]  # fmt: skip
    loaded, found = read_sequence(tomli_w.dumps(data), name, folder, target_kinds())
    faults = tuple(
        replace(
            fault, sentence=as_millimetres(fault.sentence), words=as_millimetres(fault.words),
            key=fault.key and millimetre_key(fault.key),
        )
        for fault in found
    )  # fmt: skip
    made = None if loaded is None else LoadedTarget(loaded.sequence.name, text, loaded)
    return made, faults


def _as_kilovolts(table: Any, where: str) -> Any:
    """Return the keys of a segment as a sequence has them. Raises ``InputError`` for voltages."""
    if not isinstance(table, dict):
        return table
    found = {}
    for key, value in table.items():
        if key.endswith(("_kV", "_V")):
            meant = as_millimetres(re.sub("_V$", "_kV", key))
            raise InputError(
                f"{where}: {key} = {shown(value)} is a voltage, and a target is a displacement: "
                f"write {meant}"
            )
        found[key.replace("displacement_mm", "voltage_kV").replace("_mm", "_kV")] = value
    return found


_KEY = re.compile(r"\b(\w+)_kV\b(?![/\\.])")
# not parts of a file's name
_UNIT = re.compile(r"(?<![\w/\\.-])kV\b(?![/\\.])")
_WORD = re.compile(r"(?<![\w/\\.-])voltage(s?)\b(?![/\\.])")


def millimetre_key(key: str) -> str:
    """Return the key of a target that stands for the ``key`` of a sequence."""
    return as_millimetres(key) if _KEY.fullmatch(key) else key


def as_millimetres(sentence: str) -> str:
    """Return a sentence on a sequence as one on a target."""
    sentence = _KEY.sub(
        lambda key: "displacement_mm" if key[1] == "voltage" else f"{key[1]}_mm", sentence
    )
    return _WORD.sub(r"displacement\1", _UNIT.sub("mm", sentence))
