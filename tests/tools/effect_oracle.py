"""The effects of ``dearig.model.effects`` as plain differential equations, solved by SciPy.

The thesis's film (width held, Gent springs) with one effect, without step splitting or closed
forms. Nothing here comes from kernels or effects; the tests of effects compare with it.
One piece: a function for each effect, in the order of the library.
"""
# ruff: noqa: ARG005 (the parts of an effect have one signature, as its hooks do)

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.polynomial import Legendre
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from dearig.model.film.material import STANDARD_GRAVITY, VACUUM_PERMITTIVITY


def pull(limit, e):
    """Nominal stress over the modulus of a Gent spring held in width, at its own stretch."""
    return (e - e**-3) / (1.0 - (e**2 + e**-2 - 2.0) / limit)


def same(value):
    return lambda *_: value


@dataclass
class Film:
    """Eq. 48 in numbers."""

    actuator: object
    rest: float = field(init=False)

    def __post_init__(self):
        film, network = self.actuator.film, self.actuator.network
        self.length = film.length
        self.thickness = film.thickness
        self.section = film.width * film.thickness
        self.inertia = film.density * film.length**2 / 3.0
        self.load = self.actuator.load.mass * STANDARD_GRAVITY / self.section
        permittivity = VACUUM_PERMITTIVITY * film.permittivity
        self.electric = permittivity / film.thickness**2
        self.capacitance = permittivity * film.length * film.width / film.thickness
        self.first = (network.equilibrium.modulus, network.equilibrium.limit)
        self.branches = tuple(
            (b.spring.modulus, b.spring.limit, b.relaxation_time) for b in network.branches
        )
        mu, limit = self.first
        self.rest = brentq(lambda e: mu * pull(limit, e) - self.load, 1.0, 2.0, xtol=1e-15)

    def soften_at_rest(self, factor):
        """Let the load stretch the film to where ``factor`` times its springs carry it."""
        mu, limit = self.first
        self.rest = brentq(lambda e: factor * mu * pull(limit, e) - self.load, 1.0, 2.0, xtol=1e-15)

    def strain(self, lam):
        """I1 above that at rest."""
        return lam**2 + lam**-2 - self.rest**2 - self.rest**-2


@dataclass
class Extra:
    """What an effect adds; each is a function of ``(t, lam, u, z, v)``, ``z`` the effect's state.

    ``voltage`` is that at the film, ``square`` the voltage squared, ``electric`` and ``soften``
    factors on the Maxwell and the network's stress, ``stress`` Pa against the motion, ``slopes``
    dz/dt. ``commit`` of a film with a kink gives the state after a step, and then short fixed steps
    are taken; there ``stress`` and ``soften`` also get the stretch at the beginning of the step.
    ``method`` is that of ``solve_ivp``, an implicit one where the effect is stiff.
    """

    states: int = 0
    mass: float = 0.0
    voltage: object = lambda t, lam, u, z, v: v
    square: object = lambda t, lam, u, z, v: v * v
    electric: object = same(1.0)
    soften: object = same(1.0)
    stress: object = same(0.0)
    slopes: object = same(())
    commit: object = None
    method: str = "DOP853"


def limited(value, low, high):
    return min(max(value, low), high)


def bouc_wen(u, z, power, beta):
    """z' = u - beta |u| |z|^(power - 1) z - (1 - beta) u |z|^power, as Bouc and Wen have it."""
    most = min(abs(z), 1.0) ** power  # beyond 1 no loop goes; a trial step may
    return u - beta * abs(u) * math.copysign(most, z) - (1.0 - beta) * u * most


def ramped(since):
    """The 20 ms in which a sudden change comes."""
    return limited(since / 0.02 + 0.5, 0.0, 1.0)


def spectrum(name, p):
    """Moduli in Pa and relaxation times in s of the branches of what creeps."""
    if name == "general creep":
        return (
            np.array([p[f"modulus_{i}"] for i in range(1, 11)]),
            p["relaxation_time"] * 2.0 ** np.arange(10),
        )
    if name == "slow branch":
        return np.array([p["modulus"]]), np.array([p["relaxation_time"]])
    a = p["exponent"]
    if name == "broad creep":
        times = p["relaxation_time"] * 10.0 ** (0.5 * np.arange(6))
        return p["modulus"] * (times / times[0]) ** -a, times
    times = 0.03 * 10.0 ** np.arange(6)
    return p["modulus"] * math.log(10.0) / math.gamma(a) * times**-a, times


def risen(x, knots):
    """How much of the area of a hat over three knots lies below ``x``."""
    left, middle, right = knots
    if x <= left or x >= right:
        return float(x > left)
    if x < middle:
        return (middle - left) / (right - left) * ((x - left) / (middle - left)) ** 2
    return 1.0 - (right - middle) / (right - left) * ((right - x) / (right - middle)) ** 2


def steps_at(knots, first=0):
    """The knots of every hat from number ``first`` on; before the first knot there is none."""
    return [(knots[max(i - 1, 0)], knots[i], knots[i + 1]) for i in range(first, len(knots) - 1)]


def curve_of(x, weights, hats):
    return sum(w * risen(x, knots) for w, knots in zip(weights, hats, strict=True))


def weights_of(p, word):
    return [value for key, value in p.items() if key.startswith(word)]


def extra(name, p, film, drive):
    """``Extra`` of the effect ``name`` with the numbers ``p`` on ``film``; ``drive`` is v(t)."""
    # One piece: each effect is a function of the same five names.
    rest = film.rest

    def amplifier_slew():
        fine = 1e-5
        most = fine / p["inverse_slew"]
        asked = [drive(i * fine) for i in range(round(drive.end / fine) + 2)]
        out = [asked[0]]
        for v in asked[1:]:
            out.append(out[-1] + limited(v - out[-1], -most, most))

        def voltage(t, lam, u, z, v):
            i = int(t / fine)
            return out[i] + (out[i + 1] - out[i]) * (t / fine - i)

        return Extra(voltage=voltage)

    def friction():
        # the differential form of Dahl: towards +-reach against every reversal
        size, reach, ahead = p["friction"], p["presliding"], p["damping"]

        def bending(u, z):
            return u - abs(u) * z / reach

        return Extra(
            states=1,
            stress=lambda t, lam, u, z, v: size * (z[0] + ahead * bending(u, z[0])) / reach,
            slopes=lambda t, lam, u, z, v: (bending(u, z[0]),),
        )

    def easing():
        size, reach, ahead = p["friction"], p["presliding"], p["damping"]

        def bending(u, z):
            return u - abs(u) * z / (
                reach * (1.0 + p["excess"] * math.exp(-((u / p["easing"]) ** 2)))
            )

        return Extra(
            states=1,
            stress=lambda t, lam, u, z, v: size * (z[0] + ahead * bending(u, z[0])) / reach,
            slopes=lambda t, lam, u, z, v: (bending(u, z[0]),),
        )

    def elastic_first():
        size, reach, ahead = p["friction"], p["presliding"], p["damping"]

        def bending(u, z):
            eased = math.exp(-(abs(u / p["easing"]) ** p["easing_exponent"]))
            slips = reach * (1.0 + p["excess"] * eased)
            part = z / slips if u > 0.0 else -z / slips
            if part <= p["elastic"]:
                return u
            risen = min((part - p["elastic"]) / (1.0 - p["elastic"]), 1.0)
            return u * (1.0 - math.sin(0.5 * math.pi * risen) ** 2 * part)

        return Extra(
            states=1,
            stress=lambda t, lam, u, z, v: size * (z[0] + ahead * bending(u, z[0])) / reach,
            slopes=lambda t, lam, u, z, v: (bending(u, z[0]),),
        )

    def leakage(conductivity, widening=lambda lam: 1.0, fading=lambda z, v: 1.0, **state):
        def lost(v, lam):
            return v * conductivity(v * lam / 8e3) * widening(lam)

        # what is lost at 8 kV over the unstretched film is given
        whole = p["loss"] * 8e3 / lost((1.0 - p["loss"]) * 8e3, 1.0)

        def left(t, lam, u, z, v):
            if v <= 0.0:
                return 0.0
            now = whole * fading(z, v)
            return brentq(lambda at: at + now * lost(at, lam) - v, 0.0, v, xtol=1e-9, rtol=1e-12)

        return Extra(voltage=left, **state)

    def fading():
        times = p["time_constant"] * np.array([1.0, 10.0, 100.0])
        shares = np.array([1.0, 0.1, 0.01]) ** p["exponent"]
        shares *= p["absorption"] / 8e3 / shares.sum()
        return leakage(
            lambda e: e ** p["growth"],
            lambda lam: lam ** (p["growth"] + 2.0),
            lambda z, v: max(1.0 + float(shares @ (v - np.array(z))), 0.0),
            states=3,
            slopes=lambda t, lam, u, z, v: tuple((v - np.array(z)) / times),
        )

    def elastoplastic():
        return Extra(
            states=1,
            stress=lambda t, lam, u, z, v: p["yield_stress"] * z[0],
            slopes=lambda t, lam, u, z, v: (
                bouc_wen(u / p["reach"], z[0], p["exponent"], p["asymmetry"]),
            ),
        )

    def distributed():
        k, reach, count = p["stiffness"], p["reach"], 24
        ends = [reach * ((i + 0.5) / count) ** p["spread"] for i in range(count)]

        def moved(z, travel):
            return [limited(a + travel, -e, e) for a, e in zip(z, ends, strict=True)]

        return Extra(
            states=count,
            stress=lambda t, lam, u, z, v, lam0: k * sum(moved(z, lam - lam0)) / count,
            commit=lambda z, lam0, lam: moved(z, lam - lam0),
        )

    def elements(count, ratio):
        yields = weights_of(p, "yield")
        ends = [p["reach"] / ratio ** (count - 1 - i) for i in range(count)]

        def moved(z, travel):
            return [limited(a + travel, -e, e) for a, e in zip(z, ends, strict=True)]

        return Extra(
            states=count,
            stress=lambda t, lam, u, z, v, lam0: sum(
                y * a / e for y, a, e in zip(yields, moved(z, lam - lam0), ends, strict=True)
            ),
            commit=lambda z, lam0, lam: moved(z, lam - lam0),
        )

    def flowing():
        def slope(u, z):
            none = p.get("threshold", 0.0)
            over = max(abs(z) / p["reach"] - none, 0.0) / (1.0 - none)
            return u - math.copysign(0.01 * over ** p["exponent"], z)

        return Extra(
            states=1,
            stress=lambda t, lam, u, z, v: p["flow_stress"] * z[0] / p["reach"],
            slopes=lambda t, lam, u, z, v: (slope(u, z[0]),),
        )

    def general_softening():
        hats = steps_at([i * p["reach"] / 6.0 for i in range(8)], 1)
        parts = steps_at([0.25 * i for i in range(6)])
        damage, regained = weights_of(p, "damage"), weights_of(p, "regained")

        # over the course of some seconds nothing heals within the ten thousand of the first start
        def soften(t, lam, u, z, v, lam0):
            now = abs(lam - rest)
            most = max(z[0], now)
            share = (most - now) / (most + p["width"])
            way_back = curve_of(share * (1.0 + p["width"] / p["reach"]), regained, parts)
            return 1.0 - curve_of(most, damage, hats) - way_back * most / (most + 1e-3)

        return Extra(
            states=1, soften=soften, commit=lambda z, lam0, lam: [max(z[0], abs(lam - rest))]
        )

    def general_drag():
        knots = [0.0, 6e-3, 1.8e-2, 5.4e-2, 0.162, 0.486]
        weights = weights_of(p, "drag")
        wide = knots[-1] - knots[-2]

        def stress(t, lam, u, z, v):
            total = curve_of(abs(u), weights[:-1], steps_at(knots))
            # the last slope grows up to the last knot, and stays
            part = max(abs(u) - knots[-2], 0.0) / wide
            total += weights[-1] * (part**2 if part < 1.0 else 2.0 * part - 1.0)
            return math.copysign(total, u)

        return Extra(stress=stress)

    def general_polarisation():
        strengths = np.array(weights_of(p, "strength"))
        times = p["relaxation_time"] * 3.0 ** np.arange(8)
        return Extra(
            states=8,
            square=lambda t, lam, u, z, v: (
                v * (v + float(strengths @ (np.array(z) - p["settled"] * v)))
            ),
            slopes=lambda t, lam, u, z, v: tuple((v - np.array(z)) / times),
        )

    def evenly(word):
        """Weights, and hats on even knots from 0 up to the reach and one beyond."""
        end = p.get("reach") or p.get("full")
        return weights_of(p, word), steps_at([i * end / 5.0 for i in range(7)])

    def by_field():
        weights, _ = evenly("change")
        hats = steps_at([(i * p["reach"] / 5.0) ** 2 for i in range(7)])
        return Extra(
            electric=lambda t, lam, u, z, v: (
                1.0 + curve_of((v * lam / film.thickness) ** 2, weights, hats)
            )
        )

    def mullins():
        s, w = p["softening"], p["width"]

        def soften(t, lam, u, z, v, lam0):
            now = film.strain(lam)
            most = max(z[0], now)
            return 1.0 - s * math.tanh((most - now) / (w * (most + 1e-3)))

        return Extra(
            states=1, soften=soften, commit=lambda z, lam0, lam: [max(z[0], film.strain(lam))]
        )

    def first_loading():
        def soften(t, lam, u, z, v, lam0):
            most = max(z[0], abs(lam - rest))
            x, b = (most / p["reach"]) ** p["exponent"], p["breadth"]
            kept = (1.0 + b * x) ** (-1.0 / b) if b else math.exp(-x)
            return 1.0 - p["softening"] * (1.0 - kept)

        return Extra(
            states=1, soften=soften, commit=lambda z, lam0, lam: [max(z[0], abs(lam - rest))]
        )

    def branches(moduli, times):
        return Extra(
            states=len(times),
            stress=lambda t, lam, u, z, v: (
                rest
                / lam
                * sum(m * (math.log(lam / rest) - q) for m, q in zip(moduli, z, strict=True))
            ),
            slopes=lambda t, lam, u, z, v: tuple(
                rest / lam * (math.log(lam / rest) - q) / tau
                for tau, q in zip(times, z, strict=True)
            ),
        )

    def attached():
        om, damping = 2.0 * math.pi * p["frequency"], p["damping"]
        return Extra(
            states=2,
            stress=lambda t, lam, u, z, v: p["stiffness"] * (lam - rest - z[0]),
            slopes=lambda t, lam, u, z, v: (
                z[1],
                -2.0 * damping * om * z[1] - om**2 * (z[0] - (lam - rest)),
            ),
        )

    def polarised(v, slow):
        return v * (v + p["strength"] * slow) / (1.0 + p["settled"] * p["strength"])

    def broad():
        at = np.linspace(-p["half_width"], p["half_width"], 7)
        narrowed = (1.0 - p["alpha"]) * at
        weights = 1.0 / (np.cosh(narrowed) + math.cos(math.pi * (1.0 - p["alpha"])))
        weights /= weights.sum()
        times = p["relaxation_time"] * np.exp(at)
        return Extra(
            states=7,
            square=lambda t, lam, u, z, v: polarised(v, float(weights @ np.array(z))),
            slopes=lambda t, lam, u, z, v: tuple((v - np.array(z)) / times),
        )

    def in_stages():
        strengths = np.array([p["strength"], p["sooner"], p["later"]])
        times = p["relaxation_time"] * np.array([1.0, 1.0 / p["sooner_ratio"], p["ratio"]])
        return Extra(
            states=3,
            square=lambda t, lam, u, z, v: (
                v * (v + strengths @ np.array(z)) / (1.0 + p["settled"] * strengths.sum())
            ),
            slopes=lambda t, lam, u, z, v: tuple((v - np.array(z)) / times),
        )

    def charging(gauge=0.0):
        def resistance(lam):
            return p["resistance"] * math.exp(gauge * (lam - rest))

        return Extra(
            states=1,
            voltage=lambda t, lam, u, z, v: z[0],
            slopes=lambda t, lam, u, z, v: (
                (v - z[0]) / (resistance(lam) * film.capacitance * lam**2) - 2.0 * u / lam * z[0],
            ),
        )

    def taking_up(**acts):
        """An effect of the moisture, its last state, that follows the humidity of the room."""
        states = acts.pop("states", 0) + 1
        return Extra(
            states=states,
            slopes=lambda t, lam, u, z, v: (
                *((0.0,) * (states - 1)),
                (drive.moisture(t) - z[-1]) / p["sorption_time"],
            ),
            **acts,
        )

    def moist_stiffness():
        film.soften_at_rest(1.0 + p["stiffening"] * drive.humidity)
        return taking_up(
            soften=lambda t, lam, u, z, v: 1.0 + p["stiffening"] * (drive.humidity + z[-1])
        )

    def moist_electrodes():
        def resistance(t):
            return p["resistance"] * math.exp(p["growth"] * (drive.humidity + drive.moisture(t)))

        return Extra(
            states=1,
            voltage=lambda t, lam, u, z, v: z[0],
            slopes=lambda t, lam, u, z, v: (
                (v - z[0]) / (resistance(t) * film.capacitance * lam**2) - 2.0 * u / lam * z[0],
            ),
        )

    def moist_leakage():
        ratio = p["loss"] / (1.0 - p["loss"])
        return taking_up(
            voltage=lambda t, lam, u, z, v: (
                v / (1.0 + ratio * math.exp(p["growth"] * (drive.humidity + z[-1])))
            )
        )

    def room_temperature():
        film.soften_at_rest(1.0 + p["stiffening"] * drive.temperature)
        return Extra(
            soften=lambda t, lam, u, z, v: (
                1.0 + p["stiffening"] * (drive.temperature + drive.warmth(t))
            )
        )

    def diffusing(terms=5):
        """Galerkin's equations for voltage along the sheet, in Legendre's polynomials of 0 to 1."""
        basis = [Legendre.basis(i, domain=[0.0, 1.0]) for i in range(terms)]
        steepness = np.array(
            [[(a.deriv() * b.deriv()).integ(lbnd=0.0)(1.0) for a in basis] for b in basis]
        )
        size = 1.0 / (2.0 * np.arange(terms) + 1.0)
        at_edge = np.array([b(0.0) for b in basis])
        contact = p["contact"] * p["resistance"]
        sheet = p["resistance"] - contact

        def slopes(t, lam, u, z, v):
            inwards = (v - at_edge @ z) / contact * at_edge - steepness @ z / sheet
            return tuple(inwards / size / (film.capacitance * lam**2) - 2.0 * u / lam * np.array(z))

        return Extra(
            states=terms,
            voltage=lambda t, lam, u, z, v: math.sqrt(size @ np.square(z)),
            slopes=slopes,
            method="LSODA",
        )

    known = {
        "ageing": lambda: Extra(
            states=1,
            soften=lambda t, lam, u, z, v: (
                1.0 - p["softening"] * (1.0 - math.exp(-z[0] / p["path"]))
            ),
            slopes=lambda t, lam, u, z, v: (abs(u),),
        ),
        "logarithmic ageing": lambda: Extra(
            states=1,
            soften=lambda t, lam, u, z, v: 1.0 - p["softening"] * math.log1p(z[0] / p["path"]),
            slopes=lambda t, lam, u, z, v: (abs(u),),
        ),
        "amplifier lag": lambda: Extra(
            states=1,
            voltage=lambda t, lam, u, z, v: z[0],
            slopes=lambda t, lam, u, z, v: ((v - z[0]) / p["time_constant"],),
        ),
        "amplifier limit": lambda: Extra(
            voltage=lambda t, lam, u, z, v: (
                v if v < p["knee"] else p["knee"] + (1.0 - p["flattening"]) * (v - p["knee"])
            )
        ),
        "amplifier offset": lambda: Extra(voltage=lambda t, lam, u, z, v: v + p["offset"]),
        "amplifier resonance": lambda: Extra(
            states=2,
            voltage=lambda t, lam, u, z, v: z[0],
            slopes=lambda t, lam, u, z, v: (
                z[1],
                ((v - z[0]) / p["time_constant"] - 2.0 * p["damping"] * z[1]) / p["time_constant"],
            ),
        ),
        "amplifier saturation": lambda: Extra(
            voltage=lambda t, lam, u, z, v: (
                v
                * (1.0 + p["exponent"] * p["loss"] * (v / 8e3) ** p["exponent"])
                ** (-1.0 / p["exponent"])
            )
        ),
        "amplifier slew": amplifier_slew,
        "attached mode": attached,
        "broad dielectric relaxation": broad,
        "dielectric relaxation": lambda: Extra(
            states=1,
            square=lambda t, lam, u, z, v: polarised(v, z[0]),
            slopes=lambda t, lam, u, z, v: ((v - z[0]) / p["relaxation_time"],),
        ),
        "dielectric relaxation in stages": in_stages,
        "distributed hysteresis": distributed,
        "dry friction": friction,
        "easing friction": easing,
        "elastoplastic friction": elastic_first,
        "elastoplastic hysteresis": elastoplastic,
        "electrode resistance": charging,
        "sheet electrode": diffusing,
        "strained electrode": lambda: charging(p["gauge"]),
        "stress beyond a displacement": lambda: Extra(
            stress=lambda t, lam, u, z, v: (
                p["stiffness"]
                * (0.5e-3 / film.length)
                * (max((lam - rest) * film.length - p["onset"], 0.0) / 0.5e-3) ** p["exponent"]
                * max(1.0 + p["damping"] * film.length * u, 0.0)
            )
        ),
        "field-dependent permittivity": lambda: Extra(
            electric=lambda t, lam, u, z, v: (
                1.0 / (1.0 - p["field_coefficient"] * (v * lam / film.thickness / 8e6) ** 2)
            )
        ),
        "sudden loss of field": lambda: Extra(
            voltage=lambda t, lam, u, z, v: v * (1.0 - p["loss"] * ramped(t - p["moment"]))
        ),
        "leakage": lambda: leakage(lambda e: math.exp(p["growth"] * e ** p["exponent"])),
        "hopping leakage": lambda: leakage(
            lambda e: math.sinh(p["growth"] * e) / e if e else p["growth"]
        ),
        "space-charge leakage": lambda: leakage(
            lambda e: e ** p["growth"], lambda lam: lam ** (p["growth"] + 2.0)
        ),
        "fading leakage": fading,
        "linear drag": lambda: Extra(stress=lambda t, lam, u, z, v: p["drag"] * u),
        "mixed drag": lambda: Extra(
            stress=lambda t, lam, u, z, v: p["drag"] * u + p["quadratic"] * u * abs(u)
        ),
        "power-law drag": lambda: Extra(
            stress=lambda t, lam, u, z, v: (
                p["drag"] * math.copysign((abs(u) / 0.1) ** p["exponent"], u)
            )
        ),
        "load inertia": lambda: Extra(mass=p["moving_mass"] * film.length / film.section),
        "sudden change of force": lambda: Extra(
            stress=lambda t, lam, u, z, v: p["stress"] * ramped(t - p["moment"])
        ),
        "Mullins softening": mullins,
        "first-loading damage": first_loading,
        **dict.fromkeys(
            ("power-law creep", "broad creep", "slow branch", "general creep"),
            lambda: branches(*spectrum(name, p)),
        ),
        "strain-dependent permittivity": lambda: Extra(
            electric=lambda t, lam, u, z, v: 1.0 + p["strain_coefficient"] * (lam - rest)
        ),
        "saturating permittivity": lambda: Extra(
            electric=lambda t, lam, u, z, v: (
                1.0
                + p["strain_coefficient"]
                * (lam - rest)
                * (1.0 + abs((lam - rest) / p["reach"]) ** p["sharpness"])
                ** (-1.0 / p["sharpness"])
            )
        ),
        "general amplifier curve": lambda: Extra(
            voltage=lambda t, lam, u, z, v: (
                v + math.copysign(curve_of(abs(v), *evenly("gained")), v)
            )
        ),
        "general drag": general_drag,
        "general field-dependent permittivity": by_field,
        "general friction": lambda: elements(6, 2.2),
        "general hysteresis": lambda: elements(10, 1.7),
        "general load curve": lambda: Extra(
            stress=lambda t, lam, u, z, v: curve_of(lam - rest, *evenly("gained"))
        ),
        "guide friction": lambda: Extra(
            stress=lambda t, lam, u, z, v: (
                max(p["friction"] + p["growth"] * (lam - rest), 0.0)
                / (1.0 + p["rate"] / abs(u))
                * math.copysign(1.0, u)
                if u
                else 0.0
            )
        ),
        "general polarisation": general_polarisation,
        "general softening": general_softening,
        "general strain-dependent permittivity": lambda: Extra(
            electric=lambda t, lam, u, z, v: 1.0 + curve_of(lam - rest, *evenly("change"))
        ),
        "thinning drag": lambda: Extra(
            stress=lambda t, lam, u, z, v: (
                p["drag"]
                * (u / 0.1)
                / (0.1 / (abs(u) + p["linear_below"])) ** (p["exponent"] - 1.0)
            )
        ),
        "nonlinear creep": flowing,
        "viscoplastic flow": flowing,
        "moist electrodes": moist_electrodes,
        "moist leakage": moist_leakage,
        "moist permittivity": lambda: taking_up(
            electric=lambda t, lam, u, z, v: 1.0 + p["gain"] * (drive.humidity + z[-1])
        ),
        "moist stiffness": moist_stiffness,
        "room temperature": room_temperature,
        "temperature": lambda: Extra(
            soften=lambda t, lam, u, z, v: 1.0 + p["stiffening"] * drive.warmth(t)
        ),
        "self-heating": lambda: Extra(
            states=1,
            soften=lambda t, lam, u, z, v: 1.0 + p["stiffening"] * z[0],
            slopes=lambda t, lam, u, z, v: (((v / 5e3) ** 2 - z[0]) / p["time_constant"],),
        ),
        "heated permittivity": lambda: Extra(
            states=1,
            electric=lambda t, lam, u, z, v: 1.0 + p["change"] * z[0],
            slopes=lambda t, lam, u, z, v: (((v / 5e3) ** 2 - z[0]) / p["time_constant"],),
        ),
        "loss heating": lambda: Extra(
            states=1,
            soften=lambda t, lam, u, z, v: 1.0 + p["stiffening"] * z[0],
            slopes=lambda t, lam, u, z, v: (
                # the voltage is straight between its corners
                (abs(v * (drive(t + 1e-6) - drive(t - 1e-6)) / 2e-6) / 5e3**2 - z[0])
                / p["time_constant"],
            ),
        ),
        "self-heating in stages": lambda: Extra(
            states=2,
            soften=lambda t, lam, u, z, v: 1.0 + p["stiffening"] * z[0] + p["later"] * z[1],
            slopes=lambda t, lam, u, z, v: (
                ((v / 5e3) ** 2 - z[0]) / p["time_constant"],
                ((v / 5e3) ** 2 - z[1]) / p["later_time_constant"],
            ),
        ),
        "warm-up in stages": lambda: Extra(
            soften=lambda t, lam, u, z, v: (
                1.0
                + p["stiffening"] * (1.0 - math.exp(-t / p["time_constant"]))
                + p["later"] * (1.0 - math.exp(-t / p["time_constant"] / 10.0))
            )
        ),
        "slowing warm-up": lambda: Extra(
            soften=lambda t, lam, u, z, v: (
                1.0 + p["stiffening"] * (1.0 - (1.0 + t / p["time_constant"]) ** -p["power"])
            )
        ),
        "warm-up": lambda: Extra(
            soften=lambda t, lam, u, z, v: (
                1.0 + p["stiffening"] * (1.0 - math.exp(-t / p["time_constant"]))
            )
        ),
    }
    return known[name]()


def follow(film, drive, time, effect, tolerance=1e-8, step=1e-4):
    """Stretch (N,) at ``time`` under ``drive`` (v(t), with ``breaks`` where it has corners)."""
    mu0, limit0 = film.first
    n = len(film.branches)
    inertia = film.inertia + effect.mass
    more = effect.commit is not None

    def rates(t, y, lam0=0.0):
        lam, u = y[0], y[1]
        z = y[2 + n :]
        last = (lam0,) if more else ()
        v = drive(t)
        slopes = effect.slopes(t, lam, u, z, v)
        v = effect.voltage(t, lam, u, z, v)
        held = mu0 * pull(limit0, lam)
        flows = []
        for (mu, limit, tau), xi in zip(film.branches, y[2 : 2 + n], strict=True):
            unit = pull(limit, lam / xi)
            held += mu * unit / xi
            flows.append(unit * lam / xi / tau)
        field = film.electric * effect.square(t, lam, u, z, v) * lam
        field *= effect.electric(t, lam, u, z, v)
        left = film.load + field - held * effect.soften(t, lam, u, z, v, *last)
        left -= effect.stress(t, lam, u, z, v, *last)
        return [u, left / inertia, *flows, *(slopes or [0.0] * effect.states)]

    y = [film.rest, 0.0, *([film.rest] * n), *([0.0] * effect.states)]
    if more:
        return _in_short_steps(rates, effect, time, y, n, step)
    out = np.empty(time.size)
    edges = [b for b in drive.breaks if b < time[-1]] + [time[-1]]
    for start, end in pairwise(edges):
        inside = (time >= start - 1e-12) & (time <= end + 1e-12)
        done = solve_ivp(
            lambda t, y: rates(t, y.tolist()), (start, end), y, method=effect.method,
            t_eval=np.clip(time[inside], start, end), rtol=tolerance, atol=1e-11, max_step=4e-3,
        )  # fmt: skip
        out[inside] = done.y[0, : inside.sum()]
        y = done.y[:, -1]
    return out


def _in_short_steps(rates, effect, time, y, n, step):
    """Runge-Kutta steps of no more than ``step`` s, with the kink's memory carried in between."""
    out = [y[0]]
    for t0, t1 in pairwise(time):
        count = max(round((t1 - t0) / step), 1)
        h = (t1 - t0) / count
        for m in range(count):
            t, lam0 = t0 + m * h, y[0]
            k1 = rates(t, y, lam0)
            k2 = rates(t + 0.5 * h, [a + 0.5 * h * b for a, b in zip(y, k1, strict=True)], lam0)
            k3 = rates(t + 0.5 * h, [a + 0.5 * h * b for a, b in zip(y, k2, strict=True)], lam0)
            k4 = rates(t + h, [a + h * b for a, b in zip(y, k3, strict=True)], lam0)
            y = [
                a + h / 6.0 * (b + 2.0 * (c + d) + e)
                for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=True)
            ]
            y[2 + n :] = effect.commit(y[2 + n :], lam0, y[0])
        out.append(y[0])
    return np.array(out)
