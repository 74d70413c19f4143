"""The film's stress, by generator B: creep, softening, loops, yielding and warming.

Creep. ``kohlrausch``: a relaxation modulus exp(-(t/T)^b) in slow branches. ``bergstrom_boyce``: one
branch that flows with a power of its stress and with the inelastic stretch (Bergstrom and Boyce, J.
Mech. Phys. Solids 46, 1998).

Softening. ``ogden_roxburgh``: 1 - 1/r erf((W_max - W)/m) (Ogden and Roxburgh, Proc. R. Soc. A 455,
1999) whose largest stretch heals with a time. ``simo``: damage d (1 - exp(-W_max/s)) (Simo, Comp.
Meth. Appl. Mech. Eng. 60, 1987), which heals as well or does not.

Loops. ``lognormal_stops``: Prandtl and Ishlinskii's stops with lognormal thresholds (density as in
Visintin, Differential Models of Hysteresis, 1994). ``coleman_hodgdon``: s' = |x'| (f(x) - s) +
g x', Duhem's class (Coleman and Hodgdon, Int. J. Eng. Sci. 24, 1986).

Yielding. ``perzyna``: strain rate ((|s| - Y)/Y)^n/eta beyond the yield stress (Perzyna, Adv. Appl.
Mech. 9, 1966). ``bodner_partom``: D exp(-(Z/|s|)^(2n)/2), without a threshold in the formula
(Bodner and Partom, J. Appl. Mech. 42, 1975).

Warming. ``convection``: losses against a heat flow that grows with the power 1.25 of the
temperature (McAdams, Heat Transmission, 1954). ``ramp``: the room warms steadily, and the film
follows with a time constant.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import COURSE_HEATING, COURSE_STIFFNESS, FilmNumbers
from dearig.sim_backend.truth.generator_b.spectrum import stretched_exponential
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = [
    "bergstrom_boyce",
    "bodner_partom",
    "coleman_hodgdon",
    "convection",
    "kohlrausch",
    "lognormal_stops",
    "ogden_roxburgh",
    "perzyna",
    "ramp",
    "simo",
]

_CREEP = (0.015, 0.35)  # of mu_0
_STRESS = (6.0, 350.0)  # Pa, nominal stress of a loop or at yield
_REACH = (40e-6, 500e-6)  # m
_SOFTENED = (4e-4, 0.008)  # share lost at _TRAVEL
_TRAVEL = 1e-3  # m
_STRETCH = 1.2  # about that of the thesis's film
_STOPS = 18
_PER_KELVIN = (0.002, 0.006)
_HEAT = (0.03, 0.4)  # K/s under 5 kV
_ROOM = (0.004, 0.06)  # K/s


def _of_film(family: str, words: str, **numbers: float) -> TruthEffect:
    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(**numbers)

    return TruthEffect(family=family, acts_on="film stress", description=words, on_film=on_film)


def kohlrausch(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw slow branches that relax as a stretched exponential."""
    exponent = generator.uniform(0.35, 0.7)
    time = log_uniform(generator, 4.0, 60.0)
    size = log_uniform(generator, *_CREEP)
    weights, times = stretched_exponential(exponent)
    slow = time * times > 0.3  # s: faster parts belong to the film's own branches
    shares, times = size * weights[slow], time * times[slow]

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return replace(
            film,
            moduli=(*film.moduli, *(film.moduli[0] * shares).tolist()),
            limits=(*film.limits, *(math.inf for _ in times)),
            times=(*film.times, *times.tolist()),
        )

    return TruthEffect(
        family="creep",
        acts_on="film stress",
        description=(
            f"creep: {shares.sum():.2%} of mu_0 more relaxes as a stretched exponential of "
            f"{time:.2g} s to the power of {exponent:.2f}"
        ),
        on_film=on_film,
    )


def bergstrom_boyce(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw one branch that flows with a power of its stress."""
    size = log_uniform(generator, *_CREEP)
    exponent = generator.uniform(1.5, 4.0)
    time = log_uniform(generator, 2.0, 20.0)
    strain = 0.01  # at which it relaxes within that time

    def on_film(film: FilmNumbers) -> FilmNumbers:
        modulus = size * film.moduli[0]
        return film.obeying(
            chain_spring=modulus,
            chain_stress=2.0 * modulus * strain,
            chain_rate=strain / time,
            chain_exponent=exponent,
        )

    return TruthEffect(
        family="creep",
        acts_on="film stress",
        description=(
            f"creep: a branch of {size:.2%} of mu_0 flows with the power {exponent:.2f} of its "
            f"stress, within {time:.2g} s at a strain of {strain:.0%} (Bergstrom-Boyce)"
        ),
        on_film=on_film,
    )


def _energy(travel: float) -> float:
    """Return the strain energy over the modulus, above that at rest, after ``travel`` m."""
    far = _STRETCH + travel / 0.075
    return 0.5 * (far**2 + far**-2 - _STRETCH**2 - _STRETCH**-2)


def ogden_roxburgh(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw softening below the largest energy so far, which heals."""
    lost = log_uniform(generator, *_SOFTENED)
    width = _energy(log_uniform(generator, 0.4e-3, 2e-3))
    heals = log_uniform(generator, 10.0, 200.0)
    return _of_film(
        "softening",
        f"below the largest energy so far mu_0 falls by up to {lost:.2%} (Ogden-Roxburgh); this "
        f"heals within {heals:.3g} s",
        roxburgh=lost,
        roxburgh_width=width,
        heal_time=heals,
    )


def simo(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw damage that saturates exponentially with the largest energy."""
    lost = 0.5 * log_uniform(generator, *_SOFTENED)
    reach = log_uniform(generator, 0.4e-3, 1.5e-3)
    strain = _energy(reach)
    heals = log_uniform(generator, 20.0, 300.0) if generator.random() < 0.5 else 0.0
    after = f"; it heals within {heals:.3g} s" if heals else ""
    return _of_film(
        "softening",
        f"first loading costs up to {2.0 * lost:.2%} of mu_0, by the exponential of the energy at "
        f"{reach * 1e3:.2g} mm{after}",
        simo=2.0 * lost,
        simo_strain=strain,
        heal_time=heals,
    )


def lognormal_stops(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw stops with lognormal thresholds."""
    stress = log_uniform(generator, *_STRESS)
    middle = log_uniform(generator, *_REACH)
    width = generator.uniform(0.5, 1.3)
    y = np.linspace(-2.5, 2.5, _STOPS)
    reaches = middle * np.exp(width * y)
    yields = np.exp(-0.5 * y**2)
    yields *= stress / yields.sum()

    def on_film(film: FilmNumbers) -> FilmNumbers:
        strains = reaches / film.length
        elements = zip(strains.tolist(), (yields / strains).tolist(), strict=True)
        return replace(film, stops=(*film.stops, *elements))

    return TruthEffect(
        family="rate_independent_hysteresis",
        acts_on="film stress",
        description=(
            f"a rate-independent loop of {stress:.3g} Pa over {middle * 1e6:.3g} um (lognormal "
            f"stops, width {width:.2f})"
        ),
        on_film=on_film,
    )


def coleman_hodgdon(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a loop about a curved centre line."""
    stress = log_uniform(generator, *_STRESS)
    reach = log_uniform(generator, *_REACH)
    level, width = generator.uniform(0.2, 1.0), log_uniform(generator, 0.3e-3, 1.5e-3)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(
            duhem=stress,
            duhem_reach=reach / film.length,
            duhem_slope=1.0,
            duhem_level=level,
            duhem_width=width / film.length,
        )

    return TruthEffect(
        family="rate_independent_hysteresis",
        acts_on="film stress",
        description=(
            f"a rate-independent loop (Coleman-Hodgdon) of {stress:.3g} Pa over "
            f"{reach * 1e6:.3g} um about a centre line of {level:.2f} of that"
        ),
        on_film=on_film,
    )


def perzyna(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an element that flows with a power of the stress beyond a threshold."""
    stress = log_uniform(generator, *_STRESS)
    reach = log_uniform(generator, *_REACH)
    time = log_uniform(generator, 0.03, 0.6)
    exponent = generator.uniform(1.0, 2.5)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        strain = reach / film.length / _STRETCH
        return film.stepping(0.05 * time).obeying(
            flow_spring=stress * _STRETCH / strain,
            flow_yield=stress * _STRETCH,
            flow_rate=strain / time,
            flow_exponent=exponent,
        )

    return TruthEffect(
        family="viscoplasticity",
        acts_on="film stress",
        description=(
            f"viscoplastic flow (Perzyna, power {exponent:.2f}) beyond {stress:.3g} Pa, reached "
            f"in {reach * 1e6:.3g} um, with a time of {time:.2g} s"
        ),
        on_film=on_film,
    )


def bodner_partom(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an element that flows steeply above some stress."""
    stress = log_uniform(generator, *_STRESS)
    reach = log_uniform(generator, *_REACH)
    exponent = generator.uniform(0.6, 2.0)
    limit = log_uniform(generator, 0.1, 3.0)  # 1/s
    # at a hundredth of the limiting rate the element bears ``stress``
    resisted = (2.0 * math.log(100.0)) ** (0.5 / exponent)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        strain = reach / film.length / _STRETCH
        return film.obeying(
            flow_spring=stress * _STRETCH / strain,
            flow_yield=stress * _STRETCH * resisted,
            flow_exponent=exponent,
            flow_limit=limit,
        )

    return TruthEffect(
        family="viscoplasticity",
        acts_on="film stress",
        description=(
            f"viscoplastic flow (Bodner-Partom, exponent {exponent:.2f}) at some {stress:.3g} Pa, "
            f"reached in {reach * 1e6:.3g} um, {limit:.2g} /s at most"
        ),
        on_film=on_film,
    )


def _coefficient(generator: np.random.Generator) -> float:
    return either_sign(generator) * generator.uniform(*_PER_KELVIN)


def convection(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw warming by losses, against natural convection."""
    heat = log_uniform(generator, *_HEAT)
    rate = 1.0 / log_uniform(generator, 4.0, 25.0)
    coefficient = _coefficient(generator)
    effect = _of_film(
        "thermal",
        f"the film warms by {heat * 1e3:.3g} mK/s under 5 kV against natural convection "
        f"({1.0 / rate:.2g} s at 1 K); moduli change by {coefficient:.2%}/K",
        convection_heat=heat / 5000.0**2,
        convection_rate=rate,
        convection_stiffness=coefficient,
    )
    return replace(effect, acts_on="environment")


def ramp(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a room that warms steadily."""
    rate = either_sign(generator) * log_uniform(generator, *_ROOM)
    time = log_uniform(generator, 2.0, 15.0)
    coefficient = _coefficient(generator)

    def on_course(t: np.ndarray, rows: np.ndarray) -> np.ndarray:
        warming = rate * (t + time * np.expm1(-t / time))
        rows[COURSE_STIFFNESS] *= 1.0 + coefficient * warming
        rows[COURSE_HEATING] += warming
        return rows

    return TruthEffect(
        family="thermal",
        acts_on="environment",
        description=(
            f"the room warms by {rate * 1e3:.3g} mK/s and the film follows within {time:.2g} s; "
            f"moduli change by {coefficient:.2%}/K"
        ),
        on_course=on_course,
    )
