"""A model as one file of Python that needs NumPy alone."""

from __future__ import annotations

import math
import pprint
import textwrap
from collections.abc import Iterator

import numpy as np

from dearig.config.modelfile import ModelFile
from dearig.model import kernel
from dearig.model.coefficients import (
    AIR_HUMIDITY,
    AIR_TEMPERATURE,
    CAPACITANCE,
    EFFECTS_AT,
    ELECTRIC,
    FORCE,
    HELD,
    INERTIA,
    KIND,
    LENGTH,
    LIMIT,
    LOCKING,
    MODULUS,
    RATE,
    REST,
    SECTION,
    SHAPE,
    THICKNESS,
    UNIFORM,
    WIDTH,
)
from dearig.model.effects import EFFECTS, MEMORY, PLACES, SENSOR_MEMORY, assembly
from dearig.model.film.network import HEAD
from dearig.model.film.sensor import at_sensor
from dearig.model.simulation.actuator import STATUS_TEXTS, Actuator, ends_of
from dearig.model.simulation.film_kernel import add_effects, drive_by_stretch
from dearig.report.model_export.caveats import caveats
from dearig.report.model_export.gather import gathered

__all__ = ["python_file"]

_HEAD_MEANINGS = {
    HELD: "how the film is held: 0 constrained width, 1 uniaxial, 2 equibiaxial",
    INERTIA: "kg/m: rho L1^2/3, the coefficient of lam'' without effects",
    FORCE: "Pa: nominal stress of the load, F/(L2 Z)",
    ELECTRIC: "Pa/V^2: eps/Z^2",
    UNIFORM: "code of the strain energy that all springs share, or -1",
    LENGTH: "m: L1",
    SECTION: "m^2: L2 Z",
    THICKNESS: "m: Z",
    CAPACITANCE: "F: of the film before it is stretched",
}
_SPRING_MEANINGS = {
    KIND: "code of the strain energy",
    MODULUS: "Pa: shear modulus",
    LIMIT: "locking limit",
    LOCKING: "I1 - 3 where it locks",
    RATE: "1/s: 1/T, T the relaxation time",
    SHAPE: "first further parameter of the strain energy",
    SHAPE + 1: "second one",
    SHAPE + 2: "third one",
}

_HEADER = '''\
"""The model {name!r} of dearig {version} in one file, which needs NumPy alone.

{what}
The functions are those of dearig's kernel, with their constants as numbers.
"""

import math
from typing import NamedTuple

import numpy as np

'''

_ACTUATOR = '''

def simulate(
    time,
    voltage,
    hold=False,
    lag=0.0,
    warmth=None,
    moisture=None,
    temperature=None,
    humidity=None,
):
    """Return the displacement that the sensor reads, in m, under a voltage.

    time, voltage: arrays (N,) in s and V; the time increases. hold: the voltage stands until the
    next sample, as a converter's output; otherwise it is linear in between. lag: known age of a
    reading in s. warmth, moisture: arrays (N,), temperature in K and relative humidity (0 to 1) of
    the room above those of the start; temperature, humidity: those of the start, less 296.15 K
    and 0.5. Raises ValueError where the model cannot follow.
    """
    time = np.ascontiguousarray(time, dtype=np.float64)
    voltage = np.ascontiguousarray(voltage, dtype=np.float64)
    c = coefficients()
    c[{at_temperature}] = temperature or 0.0
    c[{at_humidity}] = humidity or 0.0
    air = np.zeros((2, 0))
    if warmth is not None or moisture is not None:
        air = np.zeros((2, time.size))
        air[0] = 0.0 if warmth is None else warmth
        air[1] = 0.0 if moisture is None else moisture
    with np.errstate(all="ignore"):
        status, rest = {rest_stretch}(c, 0.0)
        if status != {ok}:
            raise ValueError(STATUS[status])
        c[{at_rest}] = rest
        y = np.zeros({state})
        y[: {motion}] = rest
        y[1] = 0.0
        stretch, rate = np.full(time.size, rest), np.zeros(time.size)
        ends = {ends_of}(voltage, hold)
        status, reached, _ = {drive}(c, time, voltage, ends, air, y, stretch, rate)
        if status != {ok}:
            raise ValueError(f"{{STATUS[status]}} (at {{time[min(reached, time.size - 1)]:.4g}} s)")
        x, u = np.empty_like(stretch), np.empty_like(rate)
        length = c[{at_length}]
        {at_sensor}(time, (stretch - rest) * length, rate * length, time - lag, x, u)
        {read_sensor}(c, time, x, u, np.zeros({sensor_memory}))
    return x
'''

_FILM = '''

def simulate(time, stretch):
    """Return the nominal stress in Pa under a stretch; both arrays (N,), the time in s.

    The film is relaxed at the first sample. Raises ValueError where the model cannot follow.
    """
    time = np.ascontiguousarray(time, dtype=np.float64)
    stretch = np.ascontiguousarray(stretch, dtype=np.float64)
    c = coefficients()
    c[{at_rest}] = stretch[0]
    parts, xi = np.zeros(({springs}, time.size)), np.full({springs} - 1, stretch[0])
    with np.errstate(all="ignore"):
        status, _ = {drive}(c, time, stretch, xi, parts)
        if status != {ok}:
            raise ValueError(STATUS[status])
        stress = c[{first}::{width}] @ parts
        {effects}(c, time, stretch, np.zeros({memory}), stress)
    return stress
'''


def python_file(given: ModelFile, version: str) -> str:
    """Return ``given`` as the text of a Python file with a function ``simulate``.

    Raises
    ------
    InputError
        If the source of the kernel cannot be read.
    """
    model = given.model
    c = model.coefficients()
    codes = {int(k) for k in c[HEAD + KIND :: WIDTH]}
    acting = int(assembly.active(c))
    if isinstance(model, Actuator):
        roots = (
            kernel.rest_stretch, ends_of, kernel.drive_by_voltage, at_sensor, kernel.read_sensor,
        )  # fmt: skip
        source, names = gathered(roots, acting, int(assembly.active_sensors(c)), codes)
        motion = 2 + len(model.network.branches)
        simulate = _ACTUATOR.format(
            **{f.__name__: names[f.__name__] for f in roots if f.__name__ in names},
            drive=names["drive_by_voltage"], ok=kernel.OK, state=motion + MEMORY, motion=motion,
            at_temperature=AIR_TEMPERATURE, at_humidity=AIR_HUMIDITY, at_rest=REST,
            at_length=LENGTH, sensor_memory=SENSOR_MEMORY,
        )  # fmt: skip
        what = "simulate(time, voltage) is the displacement of the film under a voltage."
    else:
        source, names = gathered((drive_by_stretch, add_effects), acting, 0, codes)
        simulate = _FILM.format(
            drive=names["drive_by_stretch"], effects=names["add_effects"], ok=kernel.OK,
            at_rest=REST, springs=1 + len(model.network.branches), first=HEAD + MODULUS,
            width=WIDTH, memory=MEMORY,
        )  # fmt: skip
        what = "simulate(time, stretch) is the nominal stress of the film under a stretch."
    words = pprint.pformat(dict(STATUS_TEXTS), width=88)
    return "".join(
        (
            _HEADER.format(
                name=given.name, version=version, what="\n".join([what, *_wrapped(given)])
            ),
            "\n".join(_numbers(given, c)),
            f"\n\n\nSTATUS = {words}\n\n\n",
            source,
            simulate,
        )
    )


def _wrapped(given: ModelFile) -> Iterator[str]:
    """Yield lines of the file's docstring on what the fit said against the numbers."""
    for sentence in caveats(given):
        yield from textwrap.wrap(sentence.replace("\\", "/").replace('"', "'"), width=88)


def _numbers(given: ModelFile, c: np.ndarray) -> Iterator[str]:
    """Yield the lines of a function that returns the coefficients of the model."""
    yield "\ndef coefficients():"
    yield '    """Return the numbers of the model, each with its meaning."""'
    yield f"    c = np.zeros({c.size})"
    yield "    # film and load"
    for at in range(EFFECTS_AT):
        if at in _HEAD_MEANINGS:
            yield f"    c[{at}] = {_number(c[at])}  # {_HEAD_MEANINGS[at]}"
    for name, _ in given.model.effects:
        effect = EFFECTS[name]
        yield f"    # {name}: {effect.summary}"
        for i, p in enumerate(effect.parameters):
            at = PLACES[name].at + i
            unit = f"{p.unit}: " if p.unit else ""
            yield f"    c[{at}] = {_number(c[at])}  # {unit}{p.name.replace('_', ' ')}, {p.meaning}"
    for i, at in enumerate(range(HEAD, c.size, WIDTH)):
        yield f"    # {f'branch {i}' if i else 'equilibrium spring'}"
        for k, meaning in _SPRING_MEANINGS.items():
            yield f"    c[{at + k}] = {_number(c[at + k])}  # {meaning}"
    yield "    return c"


def _number(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else f'float("{value}")'
