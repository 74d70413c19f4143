"""A model as finite-element programs take it: strain energy and Prony series."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from dearig.config.modelfile import ModelFile
from dearig.model.effects import EFFECTS
from dearig.model.film.material import Spring
from dearig.model.simulation.actuator import Actuator
from dearig.report.model_export.caveats import caveats
from dearig.report.text.laws import place_text
from dearig.report.text.numbers import significant

__all__ = ["prony_text"]

#: Of a branch at small strains: nominal stress per stretch over its modulus, and by the same
#: factor its stress relaxes faster than with T (d xi/dt = P/T with P = 4 e, 3 e or 6 e).
_FACTOR = {"constrained-width": 4.0, "uniaxial": 3.0, "equibiaxial": 6.0}
_SMALL = 0.05  # of I1 - 3 over J: below, Gent's stress is within 5 % of the neo-Hookean one
_WHERE = {
    "amplifier": "apply it to the voltage before the simulation",
    "electrode": "apply it to the voltage before the simulation, or couple a circuit",
    "dielectric": "change the Maxwell stress that loads the film",
    "inertia": "add a mass to the edge of the film",
    "load": "add a force to the edge of the film",
    "sensor": "apply it to the displacement after the simulation",
    "environment": "scale the moduli over time",
    "film stress": "it needs a user material",
}


def prony_text(given: ModelFile, version: str) -> str:
    """Return strain energy and Prony series of ``given``, and what they cannot express."""
    return "\n".join(_lines(given, version)) + "\n"


def _lines(given: ModelFile, version: str) -> Iterator[str]:
    model = given.model
    network = model.network
    is_actuator = isinstance(model, Actuator)
    kinematics = model.film.kinematics if isinstance(model, Actuator) else model.kinematics
    rest = model.rest() if isinstance(model, Actuator) else 1.0
    factor = _FACTOR[kinematics]
    terms = [
        (b.spring.modulus, b.relaxation_time * rest / factor)
        for b in network.branches
        if b.spring.modulus > 0.0
    ]
    left_out = []
    for name, values in model.effects:
        more = _creep_terms(name, dict(values), factor)
        terms += more
        if not more:
            left_out.append(name)
    long_term = network.equilibrium.modulus
    instant = long_term + sum(g for g, _ in terms)
    yield f"Model {given.name}: strain energy and Prony series (dearig {version})"
    yield ""
    yield "Incompressible material; moduli are shear moduli G, strain energies per volume."
    yield f"Long-term modulus G_inf = {long_term!r} Pa, instantaneous modulus G_0 = {instant!r} Pa."
    yield ""
    yield "  i  g_i = G_i/G_0          tau_i in s             G_i in Pa"
    for i, (g, tau) in enumerate(terms, 1):
        yield f"{i:3d}  {g / instant!r:<22} {tau!r:<22} {g!r}"
    yield ""
    yield "What the numbers mean"
    yield from (f"- {sentence}" for sentence in caveats(given))
    yield (
        f"- tau_i = T_i lambda_rest/{factor:g}: in the model d xi/dt = P(lambda/xi)/T, and near the "
        f"stretch {significant(rest, 5)} the stress of a branch decays with that time while the film "
        f"is held {kinematics}. Held otherwise, the factor is 4 (constrained width), 3 (uniaxial) or 6 "
        f"(equibiaxial); a Prony series has one tau_i for all of them."
    )
    yield (
        "- In the model a relaxed branch is free of stress at any stretch, and its stiffness is that of "
        "an unstrained spring. In a Prony series of these programs it is that of the strained one. Both "
        "agree at small strains."
    )
    if is_actuator:
        slope = (
            (1.0 + 3.0 * rest**-4) / 4.0 * rest**2 if kinematics == "constrained-width" else None
        )
        if slope is not None:
            yield (
                f"  At the rest stretch {significant(rest, 5)} the program's branches are "
                f"{significant(100.0 * abs(slope - 1.0), 2)} % {'stiffer' if slope > 1.0 else 'softer'} "
                f"than the model's (neo-Hookean)."
            )
        yield (
            "- The Maxwell stress eps (V/z)^2 is a load: apply it as a pressure on the faces, or couple "
            "electrostatics (COMSOL: Electromechanical Forces)."
        )
    kinds = {(s.kind, s.limit, s.shape) for s in network.springs if s.modulus > 0.0}
    if len(kinds) > 1:
        yield (
            "- The springs of this model differ in their energies or limits. A Prony series scales one "
            "energy: the equilibrium spring's is used for all."
        )
    for name in left_out:
        effect = EFFECTS[name]
        yield f"- Not expressed: {name} (acts {place_text(effect.acts_on)}): {_WHERE[effect.acts_on]}."
    yield from _programs(network.equilibrium, instant, long_term, terms)


def _programs(
    spring: Spring, instant: float, long_term: float, terms: list[tuple[float, float]]
) -> Iterator[str]:
    """Yield the input of each program."""
    yield ""
    yield f"Strain energy of the equilibrium spring: {spring.kind}"
    coefficients = _yeoh(spring)
    if coefficients is None:
        yield (
            f"Abaqus and FEBio: {spring.kind} is not written by this export; enter its parameters "
            f"{', '.join(f'{v!r}' for v in (spring.limit, *spring.shape))} with the modulus {instant!r} "
            f"Pa in the program's own form of it, or fit one of its energies to it."
        )
    elif spring.kind == "gent" and math.isfinite(spring.limit):
        yield (
            f"Gent's energy with J = {spring.limit!r} is written as its series of third order (Yeoh), "
            f"within 5 % of the stress up to I1 - 3 = {significant(spring.limit * 0.36, 2)}; COMSOL "
            f"has Gent's energy itself (j_m = J)."
        )
    yield ""
    yield "Abaqus (instantaneous moduli; D_1 = 0 is incompressible: use hybrid elements)"
    if coefficients is not None:
        first, second, third = (c * instant for c in coefficients)
        yield "*HYPERELASTIC, YEOH, MODULI=INSTANTANEOUS"
        yield f"{first!r}, {second!r}, {third!r}, 0., 0., 0."
    if terms:
        yield "*VISCOELASTIC, TIME=PRONY"
        for g, tau in terms:
            yield f"{g / instant!r}, 0., {tau!r}"
    yield ""
    yield "COMSOL (Hyperelastic Material with Viscoelasticity, generalized Maxwell; long-term moduli)"
    yield f"mu = {long_term!r} [Pa]; energy factors relative to it and relaxation times:"
    for i, (g, tau) in enumerate(terms, 1):
        ratio = g / long_term if long_term > 0.0 else math.inf
        yield f"branch {i}: beta_v = {ratio!r}, tau = {tau!r} [s]"
    yield ""
    yield "FEBio (uncoupled viscoelastic; the elastic part is the long-term one, g_i relative to it)"
    if spring.kind in ("neo-hookean", "gent") and long_term > 0.0:
        yield '<material id="1" name="film" type="uncoupled viscoelastic">'
        for i, (g, tau) in enumerate(terms[:6], 1):
            yield f"  <g{i}>{g / long_term!r}</g{i}> <t{i}>{tau!r}</t{i}>"
        yield (
            f'  <elastic type="Mooney-Rivlin"><c1>{0.5 * long_term!r}</c1><c2>0</c2>'
            f"<k>{1e3 * long_term!r}</k></elastic>"
        )
        yield "</material>"
        yield "k is a penalty of 1000 moduli for the volume; the energy is neo-Hookean (J is left out)."
        if len(terms) > 6:
            yield "FEBio takes six terms: the others are left out."


def _yeoh(spring: Spring) -> tuple[float, float, float] | None:
    """C10, C20, C30 over the modulus, of energies that are a series in I1 - 3."""
    if spring.kind == "neo-hookean" or (spring.kind == "gent" and math.isinf(spring.limit)):
        return 0.5, 0.0, 0.0
    if spring.kind == "gent":
        # -J/2 ln(1 - x/J) = x/2 + x^2/(4 J) + x^3/(6 J^2) + ..
        return 0.5, 0.25 / spring.limit, 1.0 / (6.0 * spring.limit**2)
    if spring.kind == "yeoh":
        second, third = spring.shape
        return 0.5, 0.5 * second, 0.5 * third
    return None


def _creep_terms(
    name: str, values: Mapping[str, float], factor: float
) -> list[tuple[float, float]]:
    """Shear moduli and times of an effect that is made of Maxwell branches; empty for others.

    Their modulus is a nominal stress per logarithmic strain, at the rest stretch.
    """
    if name == "slow branch":
        found = [(values["modulus"], values["relaxation_time"])]
    elif name == "broad creep":
        ratio = math.sqrt(10.0)
        found = [
            (
                values["modulus"] * ratio ** (-values["exponent"] * i),
                values["relaxation_time"] * ratio**i,
            )
            for i in range(6)
        ]
    elif name == "general creep":
        found = [
            (values[f"modulus_{i + 1}"], values["relaxation_time"] * 2.0**i) for i in range(10)
        ]
    else:
        return []
    return [(modulus / factor, time) for modulus, time in found if modulus > 0.0]
