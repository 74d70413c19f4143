"""Which seeds are played: a row of them, and the first ones that hide what is asked for."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

from dearig.config.rigfile import RigFile
from dearig.sim_backend.laser_noise import WHITE
from dearig.sim_backend.truth import cases
from dearig.sim_backend.truth.cases import GENERATORS, UNKNOWN, TruthCase

__all__ = [
    "CLEAN_FROM",
    "FAMILY_FROM",
    "LOOKED_AT",
    "chosen",
    "clean_seeds",
    "drawn",
    "family_seeds",
]

#: Extra clean films and extra cases of one family are looked for from these seeds on.
CLEAN_FROM, FAMILY_FROM = 1000, 2000

#: Seeds whose cases were looked at to mend the diagnosis by evidence: figures come from others.
LOOKED_AT = frozenset(
    seed
    for first, last in (
        (60000, 60063), (160000, 160033), (161000, 161007), (170000, 170032), (171000, 171011),
        (180000, 180009), (181000, 181000), (190000, 190074), (191000, 191074), (192000, 192119),
        (193000, 193029), (195000, 195064), (196000, 196460), (197000, 197039), (198000, 198349),
        (199000, 199218), (200000, 200099), (201000, 201029), (243000, 243019), (9500, 9525),
    )
    for seed in range(first, last + 1)
)  # fmt: skip

_RIG = RigFile()


def drawn(seed: int, generator: str = "first", noise: str = WHITE) -> TruthCase:
    """What the rig ``sim:seed`` hides, or that of another generator or noise."""
    return cases.draw(seed, _RIG.as_film(), _RIG.as_load(), generator=generator, noise=noise)


def clean_seeds(number: int, generator: str = "first") -> list[int]:
    """The first ``number`` seeds from ``CLEAN_FROM`` on whose rig hides nothing."""
    return _first(number, (), generator)


def family_seeds(family: str, number: int, generator: str = "first") -> list[int]:
    """The first ``number`` seeds from ``FAMILY_FROM`` on whose rig hides this family alone."""
    return _first(number, (family,), generator)


def chosen(
    first: int, any_kind: int, clean: int, per_family: int, generator: str = "first"
) -> list[int]:
    """Every seed to be played once, in the order of playing."""
    seeds = [*range(first, first + any_kind)]
    if per_family:
        for family in GENERATORS[generator]:
            seeds += family_seeds(family, per_family, generator)
    return list(dict.fromkeys([*seeds, *clean_seeds(clean, generator)]))


def kind_of(families: tuple[str, ...]) -> str:
    """``clean``, ``covered``, ``pair`` or ``unknown``."""
    if not families:
        return "clean"
    if UNKNOWN in families:
        return UNKNOWN
    return "covered" if len(families) == 1 else "pair"


def _first(number: int, families: tuple[str, ...], generator: str) -> list[int]:
    start = FAMILY_FROM if families else CLEAN_FROM
    hits = _hiding(start, families, generator)
    return [next(hits) for _ in range(number)]


def _hiding(start: int, families: tuple[str, ...], generator: str) -> Iterator[int]:
    return (seed for seed in count(start) if drawn(seed, generator).families == families)
