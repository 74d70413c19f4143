"""Which rig hides what: a case for every seed, always the same one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from model.material import TABLE_3, Film, Load, Network
from sim_backend.truth.effect import TruthEffect
from sim_backend.truth.effects import drag, load_inertia
from sim_backend.truth.film import FilmNumbers
from sim_backend.truth.plant import TruthPlant

__all__ = ["TruthCase", "draw"]

#: Effects of which a case has at most one, besides the moving mass that every rig has.
_DRAWN: tuple[Callable[[np.random.Generator, Load], TruthEffect], ...] = (drag.draw,)


@dataclass(frozen=True)
class TruthCase:
    """What the rig of ``seed`` hides. For tests and scores only: no program shows it to anybody."""

    seed: int
    film: Film
    load: Load
    effects: tuple[TruthEffect, ...]

    @property
    def families(self) -> tuple[str, ...]:
        """Families of the effects, in the order of the list."""
        return tuple(effect.family for effect in self.effects)

    @property
    def description(self) -> str:
        """The effects in words."""
        return "; ".join(effect.description for effect in self.effects)

    def plant(self, network: Network = TABLE_3) -> TruthPlant:
        """The film at rest."""
        return TruthPlant.at_rest(FilmNumbers.of(self.film, self.load, network), self.effects)


def draw(seed: int, film: Film, load: Load) -> TruthCase:
    """The case of ``seed``: the load's inertia, and one more effect or none with equal chances."""
    generator = np.random.default_rng(seed)
    effects = [load_inertia.draw(generator, load)]
    choice = int(generator.integers(len(_DRAWN) + 1))
    if choice < len(_DRAWN):
        effects.append(_DRAWN[choice](generator, load))
    return TruthCase(seed, film, load, tuple(effects))
