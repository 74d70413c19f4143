"""Hidden effects by seed: each seed always gives the same case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from dearig.model.material import TABLE_3, Branch, Film, Load, Network, Spring
from dearig.sim_backend.truth.effect import Draw, TruthEffect
from dearig.sim_backend.truth.effects import (
    amplifier,
    creep,
    dielectric_relaxation,
    drag,
    drift,
    electrode_resistance,
    end_stop,
    friction,
    interference,
    leakage,
    load_inertia,
    loose_contact,
    permittivity,
    rate_independent_hysteresis,
    second_mode,
    sensor_lag,
    sensor_nonlinearity,
    softening,
    sudden,
    thermal,
)
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.plant import TruthPlant

__all__ = ["FORMS", "KINDS", "UNKNOWN", "TruthCase", "draw"]

UNKNOWN = "unknown"

#: Forms of each family and of the effects in no family, in the order of the signal path.
FORMS: Mapping[str, tuple[Draw, ...]] = MappingProxyType(
    {
        "amplifier": (
            amplifier.offset,
            amplifier.saturation,
            amplifier.slew,
            amplifier.second_order,
        ),
        "electrode_resistance": (electrode_resistance.ladder, electrode_resistance.percolating),
        "leakage": (
            leakage.poole_frenkel,
            leakage.hopping,
            leakage.space_charge,
            leakage.tunnelling,
        ),
        "dielectric_relaxation": (
            dielectric_relaxation.three_terms,
            dielectric_relaxation.cole_cole,
        ),
        "permittivity": (permittivity.with_strain, permittivity.with_field),
        "creep": (creep.fractional, creep.broad),
        "softening": (softening.first_loading, softening.ageing),
        "thermal": (thermal.self_heating, thermal.room),
        "rate_independent_hysteresis": (
            rate_independent_hysteresis.bouc_wen,
            rate_independent_hysteresis.iwan,
        ),
        "load_inertia": (load_inertia.hung,),
        "drag": (drag.mixed, drag.air_film),
        "friction": (
            friction.lugre,
            friction.elasto_plastic,
            friction.tustin,
            friction.oiled,
        ),
        "sensor_lag": (sensor_lag.moving_average, sensor_lag.low_pass),
        "sensor_nonlinearity": (
            sensor_nonlinearity.cubic,
            sensor_nonlinearity.ripple,
            sensor_nonlinearity.soft_clip,
        ),
        "drift": (drift.root, drift.wander),
        "interference": (interference.mains,),
        UNKNOWN: (
            end_stop.end_stop,
            second_mode.hanger,
            second_mode.frame,
            sudden.load_slips,
            sudden.electrode_tears,
            sudden.mount_slips,
            loose_contact.loose_contact,
        ),
    }
)
_COVERED = tuple(family for family in FORMS if family != UNKNOWN)

#: Probability of each kind of case.
KINDS: Mapping[str, float] = MappingProxyType(
    {"clean": 0.10, "covered": 0.62, "pair": 0.13, UNKNOWN: 0.15}
)

# standard deviations of the logarithms between films
_MODULI, _TIMES = 0.15, 0.20


@dataclass(frozen=True)
class TruthCase:
    """Hidden effects of the rig of ``seed``, in a film with its own ``network``.

    For tests and scores only: no program displays it.
    """

    seed: int
    film: Film
    load: Load
    effects: tuple[TruthEffect, ...]
    network: Network = TABLE_3

    @property
    def families(self) -> tuple[str, ...]:
        """Return the families of the effects, in the order of the list."""
        return tuple(effect.family for effect in self.effects)

    @property
    def description(self) -> str:
        """Return a description of the effects."""
        return "; ".join(effect.description for effect in self.effects)

    def plant(self) -> TruthPlant:
        """Return the film at rest."""
        return TruthPlant.at_rest(self._numbers(), self.effects)

    def size(self, time: np.ndarray, voltage: np.ndarray) -> float:
        """Return the RMS in m of the change that the effects cause under ``voltage`` (N,) V.

        It is the difference of what the sensor sees at ``time`` (N,) s to the same film without
        effects. It includes the part that a fit of the film's parameters could absorb. It is
        ``inf`` where the film fails.
        """
        hiding, _ = self.plant().advance(time, voltage, True)
        plain, _ = TruthPlant.at_rest(self._numbers()).advance(time, voltage, True)
        if hiding.fault is not None or plain.fault is not None:
            return float("inf")
        return float(np.sqrt(np.mean((hiding.displacement - plain.displacement) ** 2)))

    def of_one_run(
        self, time: np.ndarray, voltage: np.ndarray, generator: np.random.Generator
    ) -> np.ndarray:
        """Return the part (N,) m of the reading that belongs to the run of ``generator`` alone.

        No other run of the rig contains it. It is computed under ``voltage`` (N,) V at ``time``
        (N,) s.
        """
        repeated = [effect for effect in self.effects if effect.redrawn is None]
        if len(repeated) == len(self.effects):
            return np.zeros_like(time)
        run, _ = self.plant().renewed(generator).advance(time, voltage, True)
        rest, _ = TruthPlant.at_rest(self._numbers(), repeated).advance(time, voltage, True)
        own: np.ndarray = run.displacement - rest.displacement
        return own

    def _numbers(self) -> FilmNumbers:
        return FilmNumbers.of(self.film, self.load, self.network)


def _drawn_network(generator: np.random.Generator) -> Network:
    """Draw a network like that of Table 3, for another film of the same make."""

    def spring(of: Spring) -> Spring:
        return Spring(of.modulus * np.exp(generator.normal(0.0, _MODULI)), of.limit, of.kind)

    return Network(
        spring(TABLE_3.equilibrium),
        tuple(
            Branch(spring(b.spring), b.relaxation_time * np.exp(generator.normal(0.0, _TIMES)))
            for b in TABLE_3.branches
        ),
    )


def _drawn_families(generator: np.random.Generator, kind: str) -> list[str]:
    if kind == "any":
        kind = str(generator.choice(list(KINDS), p=list(KINDS.values())))
    if kind == "clean":
        return []
    if kind in FORMS:
        return [kind]
    # in the order of the table, which is that of the signal path
    places = generator.choice(len(_COVERED), size=2 if kind == "pair" else 1, replace=False)
    return [_COVERED[place] for place in sorted(places)]


def draw(seed: int, film: Film, load: Load, kind: str = "any") -> TruthCase:
    """Return the case of ``seed``.

    ``kind`` is ``any``, one of ``KINDS``, or a family of ``FORMS``; raises ``ValueError`` for any
    other. The film of a seed is the same for every kind.
    """
    if kind not in ("any", *KINDS, *FORMS):
        offered = ", ".join(("any", *KINDS, *_COVERED))
        raise ValueError(f"no case of kind {kind!r}: choose one of {offered}")
    generator = np.random.default_rng(seed)
    network = _drawn_network(generator)
    effects = []
    for family in _drawn_families(generator, kind):
        form = FORMS[family][int(generator.integers(len(FORMS[family])))]
        effects.append(form(generator, load))
    return TruthCase(seed, film, load, tuple(effects), network)
