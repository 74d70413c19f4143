"""Hidden effects by seed: each seed always gives the same case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from dearig.model.film.material import TABLE_3, Branch, Film, Load, Network, Spring
from dearig.sim_backend.laser_noise import NOISES, WHITE
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
    humidity,
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
from dearig.sim_backend.truth.generator_b import dielectric, electric, sensor
from dearig.sim_backend.truth.generator_b import film as film_stress
from dearig.sim_backend.truth.generator_b import load as load_forms
from dearig.sim_backend.truth.monitored import with_monitor
from dearig.sim_backend.truth.plant import TruthPlant

__all__ = [
    "FORMS",
    "GENERATORS",
    "KINDS",
    "ROOM_FORMS",
    "SECOND_FORMS",
    "UNKNOWN",
    "TruthCase",
    "address_of",
    "case_of",
    "draw",
]

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
#: Forms that follow the air of the simulated room. They are drawn only where they are asked for by
#: name, so that what an address without that name hides never changes.
ROOM_FORMS: Mapping[str, tuple[Draw, ...]] = MappingProxyType(
    {
        "humidity": (
            humidity.plasticised,
            humidity.swollen,
            humidity.losing_contact,
            humidity.conducting,
        ),
        "weather": (thermal.weathered,),
    }
)

#: Forms of generator B: published laws that neither the model nor generator A has.
SECOND_FORMS: Mapping[str, tuple[Draw, ...]] = MappingProxyType(
    {
        "amplifier": (electric.tanh_stage, electric.slewing_pair, electric.intercept),
        "electrode_resistance": (electric.measured_gauge, electric.contacts),
        "leakage": (electric.trap_filled,),
        "dielectric_relaxation": (dielectric.kohlrausch, dielectric.havriliak_negami),
        "permittivity": (dielectric.booth, dielectric.johnson, dielectric.peaked),
        "creep": (film_stress.kohlrausch, film_stress.bergstrom_boyce),
        "softening": (film_stress.ogden_roxburgh, film_stress.simo),
        "thermal": (film_stress.convection, film_stress.ramp),
        "rate_independent_hysteresis": (film_stress.lognormal_stops, film_stress.coleman_hodgdon),
        "viscoplasticity": (film_stress.perzyna, film_stress.bodner_partom),
        "load_inertia": (load_forms.lever, load_forms.pulley),
        "drag": (load_forms.carreau, load_forms.ostwald, load_forms.naumann),
        "friction": (load_forms.maxwell_slip, load_forms.makkar),
        "sensor_lag": (sensor.delay, sensor.butterworth),
        "sensor_nonlinearity": (sensor.triangulation, sensor.legendre),
        "drift": (sensor.logarithm, sensor.brownian),
        "interference": (sensor.fan,),
        UNKNOWN: (load_forms.magnet, load_forms.swing),
    }
)

#: Whose forms a case has.
GENERATORS: Mapping[str, Mapping[str, tuple[Draw, ...]]] = MappingProxyType(
    {"first": FORMS, "second": SECOND_FORMS}
)


def _covered(generator: str) -> tuple[str, ...]:
    return tuple(family for family in GENERATORS[generator] if family != UNKNOWN)


#: Probability of each kind of case.
KINDS: Mapping[str, float] = MappingProxyType(
    {"clean": 0.10, "covered": 0.62, "pair": 0.13, UNKNOWN: 0.15}
)

# standard deviations of the logarithms between films
_MODULI, _TIMES = 0.15, 0.20


@dataclass(frozen=True)
class TruthCase:
    """Hidden effects of the rig of ``seed``, in a film with its own ``network``.

    ``generator`` is one of ``GENERATORS``, ``noise`` the kind of the
    laser's noise, one of ``NOISES``. For tests and scores only: no program displays it.
    """

    seed: int
    film: Film
    load: Load
    effects: tuple[TruthEffect, ...]
    network: Network = TABLE_3
    generator: str = "first"
    noise: str = WHITE

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
        self, time: np.ndarray, voltage: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Return the part (N,) m of the reading that belongs to the run of ``rng`` alone.

        No other run of the rig contains it. It is computed under ``voltage`` (N,) V at ``time``
        (N,) s.
        """
        repeated = [effect for effect in self.effects if effect.redrawn is None]
        if len(repeated) == len(self.effects):
            return np.zeros_like(time)
        run, _ = self.plant().renewed(rng).advance(time, voltage, True)
        rest, _ = TruthPlant.at_rest(self._numbers(), repeated).advance(time, voltage, True)
        own: np.ndarray = run.displacement - rest.displacement
        return own

    def _numbers(self) -> FilmNumbers:
        return FilmNumbers.of(self.film, self.load, self.network)


def _drawn_network(rng: np.random.Generator) -> Network:
    """Draw a network like that of Table 3, for another film of the same make."""

    def spring(of: Spring) -> Spring:
        return Spring(of.modulus * np.exp(rng.normal(0.0, _MODULI)), of.limit, of.kind)

    return Network(
        spring(TABLE_3.equilibrium),
        tuple(
            Branch(spring(b.spring), b.relaxation_time * np.exp(rng.normal(0.0, _TIMES)))
            for b in TABLE_3.branches
        ),
    )


def _drawn_families(rng: np.random.Generator, kind: str, generator: str) -> list[str]:
    if kind == "any":
        kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    if kind == "clean":
        return []
    if kind in GENERATORS[generator] or kind in ROOM_FORMS:
        return [kind]
    # in the order of the table, which is that of the signal path
    covered = _covered(generator)
    places = rng.choice(len(covered), size=2 if kind == "pair" else 1, replace=False)
    return [covered[place] for place in sorted(places)]


def draw(
    seed: int,
    film: Film,
    load: Load,
    kind: str = "any",
    *,
    generator: str = "first",
    noise: str = WHITE,
) -> TruthCase:
    """Return the case of ``seed``.

    ``kind`` is ``any``, one of ``KINDS``, a family of the generator's forms, or one of
    ``ROOM_FORMS``: what follows the air of the simulated room. Raises ``ValueError`` for any other.
    The film of a seed is the same for every kind, generator and noise.

    ``generator`` ``"second"`` draws from ``SECOND_FORMS``: published laws that the model does not
    have, under the same names of families. ``noise`` is one of ``NOISES``: what the laser adds.
    ``address_of`` gives the address at which the rig of a case can be opened.
    """
    if generator not in GENERATORS:
        raise ValueError(f"no generator {generator!r}: choose one of {', '.join(GENERATORS)}")
    if noise not in NOISES:
        raise ValueError(f"no noise {noise!r}: choose one of {', '.join(NOISES)}")
    forms = {**GENERATORS[generator], **ROOM_FORMS}
    if kind not in ("any", *KINDS, *forms):
        offered = ", ".join(("any", *KINDS, *_covered(generator), *ROOM_FORMS))
        raise ValueError(f"no case of kind {kind!r}: choose one of {offered}")
    rng = np.random.default_rng(seed)
    network = _drawn_network(rng)
    effects = []
    for family in _drawn_families(rng, kind, generator):
        form = forms[family][int(rng.integers(len(forms[family])))]
        effects.append(with_monitor(form(rng, load), seed))
    return TruthCase(seed, film, load, tuple(effects), network, generator, noise)


def address_of(seed: int, generator: str = "first", noise: str = WHITE) -> str:
    """Return the address of the rig with the case of ``seed``: ``sim:7``, ``sim:7:second:spikes``.

    What is not the default stands behind the seed, separated by colons.
    """
    chosen = [generator] * (generator != "first") + [noise] * (noise != WHITE)
    return ":".join(("sim", str(seed), *chosen))


def case_of(seed: int, words: Sequence[str], film: Film, load: Load) -> TruthCase:
    """Return the case of ``seed`` with a generator, a noise and a kind given by ``words``.

    The kind is one of ``ROOM_FORMS``, or any. Raises ``ValueError`` for a word that is none of
    them, or for two of one sort.
    """
    generators = [word for word in words if word in GENERATORS]
    noises = [word for word in words if word in NOISES]
    rooms = [word for word in words if word in ROOM_FORMS]
    other = [word for word in words if word not in (*generators, *noises, *rooms)]
    if other or max(len(generators), len(noises), len(rooms)) > 1:
        raise ValueError(
            f"behind the seed stand one of {', '.join(GENERATORS)}, one of {', '.join(NOISES)} and "
            f"one of {', '.join(ROOM_FORMS)}, not {':'.join(words)}"
        )
    return draw(
        seed,
        film,
        load,
        (*rooms, "any")[0],
        generator=(*generators, "first")[0],
        noise=(*noises, WHITE)[0],
    )
