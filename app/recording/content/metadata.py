"""Metadata of a run: everything in a recording besides its samples and instruments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from dearig.model.film.specimen import Film, Load

__all__ = ["RunMetadata"]


@dataclass(frozen=True)
class RunMetadata:
    """Metadata of a run; what is not known stays empty.

    Attributes
    ----------
    title : str
        Name of the run. A live run without one takes the name of its sequence.
    film, load : Film, Load or None
        The film and the load that hangs from it.
    film_id : str
        The operator's name for the film.
    notes, operator : str
        Free text, and who ran it.
    sequence_toml, model_toml : str
        The sequence that was played and the parameters of the model, as TOML.
    configuration : str
        Text of the rig file in force.
    seed : int or None
        Seed of a simulated rig.
    provenance : mapping
        Further texts, numbers and booleans for ``/entry/provenance``, by name.
    """

    title: str = ""
    film: Film | None = None
    load: Load | None = None
    film_id: str = ""
    notes: str = ""
    operator: str = ""
    sequence_toml: str = ""
    model_toml: str = ""
    configuration: str = ""
    seed: int | None = None
    provenance: Mapping[str, object] = field(default_factory=dict)
