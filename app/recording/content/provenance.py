"""Provenance of a recording: program versions, configuration, host, operator."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping

import h5py
import numpy as np

from dearig.recording.content.layout import iso_time
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.content.text import fixed, put_text, text_of
from dearig.revision import revision, version

__all__ = [
    "CONTINUES",
    "FROM_IMPORT",
    "START_FROM",
    "gather",
    "is_start_known",
    "read_provenance",
    "write_provenance",
]

#: Name of the text with the path of the recording that a recording continues. It has no lead-in:
#: its displacement is counted from that of the other.
CONTINUES = "continues"

#: Name of the text that says what tells the start of imported data; without it, and for
#: ``FROM_IMPORT``, the start of the recording is the moment of the import.
START_FROM, FROM_IMPORT = "start_time_from", "the import"

#: Characters; longer texts are datasets, because an HDF5 attribute holds 64 KB at most.
LONGEST_ATTRIBUTE = 1000


def gather(started: float, metadata: RunMetadata) -> dict[str, object]:
    """Return the provenance of a recording that was started at the Unix time ``started`` in s."""
    found: dict[str, object] = {
        "start_time": iso_time(started),
        "operator": metadata.operator,
        "host": platform.node(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "dearig_version": version(),
        "git_revision": revision().commit,
        "python_version": platform.python_version(),
        "numpy_version": np.__version__,
        "h5py_version": h5py.__version__,
        "hdf5_version": h5py.version.hdf5_version,
        "configuration": metadata.configuration,
        "configuration_sha256": hashlib.sha256(metadata.configuration.encode("utf-8")).hexdigest(),
    }
    if metadata.seed is not None:
        found["seed"] = metadata.seed
    return found | dict(metadata.provenance)


def is_start_known(noted: Mapping[str, object]) -> bool:
    """Return False where the start time is that of an import, by the provenance ``noted``."""
    return "source" not in noted or str(noted.get(START_FROM, FROM_IMPORT)) != FROM_IMPORT


def write_provenance(entry: h5py.Group, provenance: Mapping[str, object]) -> None:
    """Write ``provenance`` (texts, numbers and booleans) to ``entry/provenance``."""
    group = entry.create_group("provenance")
    group.attrs["NX_class"] = fixed("NXcollection")
    for name, value in provenance.items():
        if name == "configuration" or len(str(value)) > LONGEST_ATTRIBUTE:
            put_text(group, name, str(value))
        elif isinstance(value, bool | int | float):
            group.attrs[name] = value
        else:
            group.attrs[name] = fixed(str(value))


def read_provenance(group: h5py.Group) -> dict[str, object]:
    """Return ``entry/provenance`` as plain texts, numbers and booleans."""
    found: dict[str, object] = {}
    for name, value in group.attrs.items():
        if name == "NX_class":
            continue
        plain = isinstance(value, np.number | np.bool_)
        found[name] = value.item() if plain else text_of(value)
    for name, item in group.items():
        if isinstance(item, h5py.Dataset):
            found[name] = text_of(item[()])
    return found
