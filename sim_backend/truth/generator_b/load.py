"""The load's inertia, drag and friction, and what is in no family, by generator B.

Inertia. ``lever``: the load moves a lever, so that the moving mass changes with the travel
(Lagrange's equation: M x'' + M' x'^2/2). ``pulley``: a pulley's inertia J/r^2 adds to the mass.

Drag. ``carreau``: a fluid that thins with the rate, (1 + (v/v_0)^2)^((n-1)/2) v (Carreau, Trans.
Soc. Rheol. 16, 1972). ``ostwald``: the same far beyond v_0, a power below 1 (Ostwald and de Waele,
1923), as of grease. ``naumann``: v (1 + 0.15 (v/v_0)^0.687), a sphere in a fluid (Schiller and
Naumann, Z. VDI 77, 1933).

Friction. ``maxwell_slip``: a few elasto-slide elements of micrometres (Lampaert, Swevers and
Al-Bender, IEEE Trans. Autom. Control 47, 2002). ``makkar``: tanh(v/v_1) + a (tanh(v/v_1) -
tanh(v/v_2)), a function of the rate alone (Makkar, Dixon, Sawyer and Hu, AIM 2005).

No family. ``magnet``: a magnet below the load pulls with the inverse square of the gap. ``swing``:
the hung load swings as a pendulum from the start of each run; the sensor sees its rise.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = [
    "carreau",
    "lever",
    "magnet",
    "makkar",
    "maxwell_slip",
    "naumann",
    "ostwald",
    "pulley",
    "swing",
]

_MASS = (0.6, 1.2)  # of the load
_SPEED = 0.003  # m/s, typical of a lobe; drags are compared at this speed
_DRAG = (0.8, 18.0)  # N s/m at that speed
_FRICTION = (0.4e-3, 15e-3)  # N
_SWING = (4e-6, 60e-6)  # m


def lever(generator: np.random.Generator, load: Load) -> TruthEffect:
    """Draw a moving mass that changes with the travel."""
    mass = load.mass * log_uniform(generator, *_MASS)
    change = either_sign(generator) * generator.uniform(2.0, 8.0)  # for a stretch of 1

    def on_film(film: FilmNumbers) -> FilmNumbers:
        inertia = film.inertia + mass * film.length / film.section
        return replace(film, inertia=inertia).obeying(lever=change)

    return TruthEffect(
        family="load_inertia",
        acts_on="inertia",
        description=(
            f"a mass of {mass * 1e3:.1f} g moves on a lever and changes by {change * 0.02:.1%} "
            f"in 1.5 mm"
        ),
        on_film=on_film,
    )


def pulley(generator: np.random.Generator, load: Load) -> TruthEffect:
    """Draw the hung mass and a pulley that turns with it."""
    rim = log_uniform(generator, 0.05, 0.5) * load.mass

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return replace(film, inertia=film.inertia + (load.mass + rim) * film.length / film.section)

    return TruthEffect(
        family="load_inertia",
        acts_on="inertia",
        description=f"the load turns a pulley whose rim counts as {rim * 1e3:.1f} g",
        on_film=on_film,
    )


def _dragging(words: str, per_speed: float, corner: float, exponent: float) -> TruthEffect:
    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(
            carreau=per_speed * film.length / film.section,
            carreau_rate=corner / film.length,
            carreau_exponent=exponent,
        )

    return TruthEffect(family="drag", acts_on="load", description=words, on_film=on_film)


def carreau(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a drag that thins at a speed within the lobes."""
    size = log_uniform(generator, *_DRAG)
    corner = log_uniform(generator, 0.7e-3, 6e-3)
    exponent = generator.uniform(0.2, 0.7)
    at_rest = size * (1.0 + (_SPEED / corner) ** 2) ** (0.5 * (1.0 - exponent))
    return _dragging(
        f"drag of {at_rest:.3g} N s/m that thins beyond {corner * 1e3:.2g} mm/s (Carreau, "
        f"power {exponent:.2f})",
        at_rest,
        corner,
        exponent,
    )


def ostwald(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a drag by a power of the speed below 1."""
    size = log_uniform(generator, *_DRAG)
    corner = log_uniform(generator, 0.02e-3, 0.2e-3)
    exponent = generator.uniform(0.3, 0.85)
    at_rest = size * (1.0 + (_SPEED / corner) ** 2) ** (0.5 * (1.0 - exponent))
    return _dragging(
        f"drag of {size:.3g} N s/m at 3 mm/s, by the power {exponent:.2f} of the speed beyond "
        f"{corner * 1e3:.2g} mm/s",
        at_rest,
        corner,
        exponent,
    )


def naumann(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw the drag of a sphere between creeping and fast flow."""
    corner = log_uniform(generator, 0.05e-3, 1e-3)
    whole = log_uniform(generator, *_DRAG)
    size = whole / (1.0 + 0.15 * (_SPEED / corner) ** 0.687)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(
            naumann=size * film.length / film.section, naumann_rate=corner / film.length
        )

    return TruthEffect(
        family="drag",
        acts_on="load",
        description=(
            f"drag of a body in a fluid (Schiller-Naumann), {size:.3g} N s/m at rest and "
            f"{whole:.3g} N s/m at 3 mm/s"
        ),
        on_film=on_film,
    )


def maxwell_slip(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw six elements that slip one after the other within micrometres."""
    force = log_uniform(generator, *_FRICTION)
    reaches = np.sort(generator.uniform(2e-6, 35e-6, 6))
    shares = generator.dirichlet(np.full(6, 4.0))

    def on_film(film: FilmNumbers) -> FilmNumbers:
        strains = reaches / film.length
        stiffness = force * shares / film.section / strains
        fastest = math.sqrt(float(stiffness.sum()) / film.inertia)
        elements = zip(strains.tolist(), stiffness.tolist(), strict=True)
        return replace(film, stops=(*film.stops, *elements)).stepping(0.25 / fastest)

    return TruthEffect(
        family="friction",
        acts_on="load",
        description=(
            f"friction of {force * 1e3:.3g} mN in six elements that slip within "
            f"{reaches[0] * 1e6:.2g} to {reaches[-1] * 1e6:.3g} um"
        ),
        on_film=on_film,
    )


def makkar(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a friction that is a smooth function of the speed."""
    force = log_uniform(generator, *_FRICTION)
    rise = log_uniform(generator, 0.05e-3, 0.3e-3)  # m/s
    excess, fall = generator.uniform(0.05, 0.5), log_uniform(generator, 1e-3, 6e-3)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(
            makkar=force / film.section,
            makkar_rise=rise / film.length,
            makkar_excess=excess,
            makkar_fall=fall / film.length,
        )

    return TruthEffect(
        family="friction",
        acts_on="load",
        description=(
            f"friction of {force * 1e3:.3g} mN beyond {rise * 1e3:.2g} mm/s, {excess:.0%} more "
            f"below {fall * 1e3:.2g} mm/s (Makkar)"
        ),
        on_film=on_film,
    )


def magnet(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a magnet that pulls the load further as it comes nearer."""
    gap = generator.uniform(5e-3, 8e-3)
    force = log_uniform(generator, 0.7e-3, 20e-3)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(magnet=force / film.section, magnet_gap=gap / film.length)

    return TruthEffect(
        family="unknown",
        acts_on="load",
        description=f"a magnet {gap * 1e3:.2g} mm below the load pulls with {force * 1e3:.3g} mN",
        on_film=on_film,
    )


def swing(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a pendulum that swings down during the run."""
    size = log_uniform(generator, *_SWING)
    omega = 2.0 * math.pi * generator.uniform(0.9, 2.2)  # of the pendulum; its rise has twice that
    damping = 1.0 / log_uniform(generator, 6.0, 30.0)  # 1/s
    phase = generator.uniform(0.0, 2.0 * math.pi)

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        left = size * np.exp(-2.0 * damping * t)
        angle = 2.0 * omega * t + phase
        rows[0] += left * np.cos(angle) - size * math.cos(phase)
        rows[1] -= left * (2.0 * omega * np.sin(angle) + 2.0 * damping * np.cos(angle))
        return rows, carry

    return TruthEffect(
        family="unknown",
        acts_on="load",
        description=(
            f"the load swings: the reading moves by {size * 1e6:.3g} um at "
            f"{omega / math.pi:.2g} Hz, half as much after {math.log(2.0) / 2.0 / damping:.2g} s"
        ),
        on_motion=on_motion,
    )
