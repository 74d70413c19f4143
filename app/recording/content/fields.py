"""Fields of a recording that lists show: one line for each.

From a line of ``TEXTS`` follow how the text is read (``Recording.texts``), its row and its key in
``dearig info``, the index of a folder, the table of recordings in the window with its search, what
an import of an exported recording keeps, and the column in the table of a study. From a line of
``CONDITIONS`` follow the attribute of /entry, ``Recording.conditions``, ``dearig info``, the index,
what the window shows as a difference between runs, and the column that trends are sought along.

A text reaches the file as an entry of ``RunMetadata.provenance``, or by an attribute of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import h5py

from dearig.drivers.channels import HUMIDITY
from dearig.recording.content.safe import dataset, group
from dearig.recording.content.text import text_of

__all__ = ["CONDITIONS", "TEXTS", "Condition", "TextField", "read_texts"]


@dataclass(frozen=True)
class TextField:
    """A text of a recording that is listed.

    Attributes
    ----------
    place : str
        Where it is below /entry: an attribute of a group or a dataset in it.
    label, tip : str
        Heading of its column, and its explanation.
    characters : int
        Width of the column.
    shown : bool
        True if the column is among those of the first start.
    wide : bool
        True if the column takes a part of the width that is left.
    column : str
        Name of its column in the table of a study, "" without one.
    """

    place: str
    label: str
    tip: str
    characters: int = 11
    shown: bool = False
    wide: bool = False
    column: str = ""

    @property
    def in_provenance(self) -> bool:
        """True if the text is a part of the provenance, which is listed as a whole."""
        return self.place.startswith("provenance/")


#: Texts by their keys in ``Recording.texts`` and in JSON, in the order of their columns.
TEXTS: Mapping[str, TextField] = MappingProxyType(
    {
        "film_id": TextField(
            "sample/name", "Film", "Name of the film", 13, shown=True, wide=True, column="film"
        ),
        "rig": TextField("provenance/rig", "Rig", "Address of the rig", column="rig"),
        "operator": TextField(
            "provenance/operator", "Operator", "Operator of the run", 8, shown=True,
            column="operator",
        ),
        "notes": TextField("sample/notes", "Notes", "Notes of the operator", 20, wide=True),
    }
)  # fmt: skip


def read_texts(entry: h5py.Group) -> dict[str, str]:
    """Return the ``TEXTS`` of the recording ``entry`` by their keys; "" for one that is not there.

    Raises ``Refused`` for a text that is not stored in the file itself.
    """
    return {key: _read(entry, *field.place.split("/")) for key, field in TEXTS.items()}


def _read(entry: h5py.Group, parent: str, name: str) -> str:
    found = group(entry, parent)
    if found is None:
        return ""
    if name in found.attrs:
        return text_of(found.attrs[name])
    # a long text is a dataset
    stored = dataset(found, name)
    return "" if stored is None else text_of(stored[()])


@dataclass(frozen=True)
class Condition:
    """A condition of a run of which the mean is kept.

    Attributes
    ----------
    channel : str
        Channel whose mean it is, unless a thermo-hygrometer measures it.
    label, unit : str
        What it is, and the unit of its values.
    tight : float
        Range below which it counts as not varied between runs.
    short, slope_unit : str
        Label in a line of several conditions, and unit after "per"; by default ``label``, ``unit``.
    """

    channel: str
    label: str
    unit: str
    tight: float
    short: str = ""
    slope_unit: str = ""


#: Conditions by their keys: attributes of /entry, keys of ``Recording.conditions`` and in JSON.
#: ``tight`` is the range of a room that is held within a standard atmosphere of class 1 (ISO 291:
#: 1 °C and 5 % either way).
CONDITIONS: Mapping[str, Condition] = MappingProxyType(
    {
        "temperature_degC": Condition("temperature", "temperature", "°C", 2.0),
        "relative_humidity_percent": Condition(
            HUMIDITY, "relative humidity", "%", 10.0, short="humidity", slope_unit="% RH"
        ),
    }
)
