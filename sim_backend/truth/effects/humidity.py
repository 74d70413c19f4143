"""A film that takes up moisture from the room by Fick's diffusion, with what came before the run.

The mean moisture of a film of thickness Z whose faces are in equilibrium with the air is a sum over
the modes of diffusion: each follows the air with the time tau/(2k + 1)^2, tau = Z^2/(pi^2 D), and
has the weight 8/(pi^2 (2k + 1)^2) (Crank, The Mathematics of Diffusion, 1975, section 4.3). The
film therefore remembers the room of the hours before. Four forms of what moisture does:

``plasticised``: moduli fall as exp(-a c), c the moisture from 0 (dry) to 1 (saturated), as a film's
do whose glass transition water lowers. ``swollen``: water is a second phase with a permittivity of
80 in the volume share c^1.5 v, mixed by Looyenga's law, eps^(1/3) = (1 - p) e^(1/3) + p 80^(1/3)
(Physica 31, 401 (1965)). ``losing_contact``: the electrode's resistance grows as (1 + c)^n with the
air itself; the film charges through it. ``conducting``: ions in the water carry a current, and the
resistance of the film falls as c^-n between 30 and 90 % of humidity, as Hearle measured it (J.
Text. Inst. 44, T117 (1953); Morton and Hearle, Physical Properties of Textile Fibres, 22.4.1).
There n is 7 to 13 for hygroscopic fibres; the films that are drawn are less so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.plant import Air
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import COURSE_ELECTRIC, COURSE_STIFFNESS, FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["conducting", "losing_contact", "plasticised", "swollen"]

_REFERENCE = 0.5  # relative humidity at which a film has the numbers of its data
_MODES = 6
_PAST = 6.0  # slowest times that count of the room's past
_STEPS = 100  # of the grid in a slowest time
_SORPTION = (120.0, 3600.0)  # s, the slowest time
_SOFTER = (0.15, 0.6)  # a
_WATER = (0.004, 0.02)  # v, in a saturated room
_WATER_PERMITTIVITY, _FILM_PERMITTIVITY = 80.0, 4.7
_RESISTANCE = (2e7, 1.5e8)  # ohm at the reference
_POWER = (2.0, 6.0)
_SERIES = (1e6, 3e6)  # ohm, of the electrodes through which a leaking film is supplied
_LOST = (50.0, 250.0)  # V lost in them at 8 kV and at the reference
_AT = 8000.0  # V
_CONDUCTING = (3.0, 8.0)  # n


class _Moisture:
    """Moisture of a film in ``air``, whose slowest mode follows in ``slowest`` s.

    It is computed on a grid that does not depend on the times that are asked for, and kept.
    """

    def __init__(self, air: Air, slowest: float) -> None:
        self._air = air
        order = 2.0 * np.arange(_MODES) + 1.0
        weights = 8.0 / (math.pi**2 * order**2)
        self._weights = weights / weights.sum()  # modes that are left out follow with the others
        self._rates = order**2 / slowest
        self._step = slowest / _STEPS
        past = self._step * np.arange(-round(_PAST * _STEPS), 1)
        humid = 0.01 * air.humidity(past)
        self._modes = np.full(_MODES, humid[0])
        for before, after in pairwise(humid):
            self._modes = _followed(self._modes, before, after, self._step, self._rates)
        self._course = [float(self._modes @ self._weights)]

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the moisture (N,) at ``time`` (N,) s of the run."""
        needed = math.ceil(float(time[-1]) / self._step) + 1
        done = len(self._course) - 1
        if needed > done:
            humid = 0.01 * self._air.humidity(self._step * np.arange(done, needed + 1))
            for before, after in pairwise(humid):
                self._modes = _followed(self._modes, before, after, self._step, self._rates)
                self._course.append(float(self._modes @ self._weights))
        grid = self._step * np.arange(len(self._course))
        return np.asarray(np.interp(time, grid, self._course))


def _followed(
    modes: np.ndarray, before: float, after: float, step: float, rates: np.ndarray
) -> np.ndarray:
    """Return the ``modes`` after a ``step`` in s of air on a line; exact."""
    left, slope = np.exp(-rates * step), (after - before) / (rates * step)
    lagging: np.ndarray = after - slope + (modes - before + slope) * left
    return lagging


def _moist(
    sorption: float, words: str, factor: Callable[[np.ndarray], np.ndarray], electric: bool
) -> TruthEffect:
    """Return an effect whose ``factor`` of the moisture acts on the pull or on all moduli."""

    def of_film(numbers: FilmNumbers, start: float) -> FilmNumbers:
        if electric:
            return numbers.permitting(start)
        return numbers.stiffened(start)

    def in_room(air: Air) -> TruthEffect:
        moisture = _Moisture(air, sorption)
        start = float(factor(moisture.at(np.zeros(1)))[0])

        def on_course(time: np.ndarray, rows: np.ndarray) -> np.ndarray:
            row = COURSE_ELECTRIC if electric else COURSE_STIFFNESS
            rows[row] *= factor(moisture.at(time)) / start
            return rows

        return TruthEffect(
            family="humidity", acts_on=acts_on, description=words, in_room=in_room,
            on_film=lambda numbers: of_film(numbers, start), on_course=on_course,
        )  # fmt: skip

    acts_on = "dielectric" if electric else "film stress"
    return TruthEffect("humidity", acts_on, words, in_room=in_room)


def plasticised(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw moduli that fall with moisture."""
    softer, sorption = log_uniform(generator, *_SOFTER), log_uniform(generator, *_SORPTION)
    return _moist(
        sorption,
        f"moduli fall by {1.0 - math.exp(-softer):.1%} from dry to saturated, in {sorption:.3g} s",
        lambda moisture: np.exp(-softer * (moisture - _REFERENCE)),
        electric=False,
    )


def swollen(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a permittivity that grows with the water in the film."""
    water, sorption = log_uniform(generator, *_WATER), log_uniform(generator, *_SORPTION)

    def mixed(moisture: np.ndarray) -> np.ndarray:
        share = water * np.maximum(moisture, 0.0) ** 1.5
        root = (1.0 - share) * _FILM_PERMITTIVITY ** (1.0 / 3.0)
        return np.asarray((root + share * _WATER_PERMITTIVITY ** (1.0 / 3.0)) ** 3)

    at_reference = float(mixed(np.full(1, _REFERENCE))[0])
    return _moist(
        sorption,
        f"{water:.2%} of water in a saturated film, taken up in {sorption:.3g} s",
        lambda moisture: mixed(moisture) / at_reference,
        electric=True,
    )


def losing_contact(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw electrodes whose resistance grows with the humidity of the air."""
    resistance, power = log_uniform(generator, *_RESISTANCE), log_uniform(generator, *_POWER)
    text = f"electrodes of {resistance / 1e6:.3g} Mohm at 50 %, growing with the power {power:.2g}"

    def charging(air: Air) -> Callable[[FilmNumbers], FilmNumbers]:
        moist = 0.01 * float(air.humidity(np.zeros(1))[0])
        now = resistance * ((1.0 + moist) / (1.0 + _REFERENCE)) ** power

        def on_film(numbers: FilmNumbers) -> FilmNumbers:
            return numbers.stepping(now * numbers.capacitance).hiding(ladder_1=now)

        return on_film

    def in_room(air: Air) -> TruthEffect:
        return TruthEffect("humidity", "electrode", text, in_room=in_room, on_film=charging(air))

    return TruthEffect("humidity", "electrode", text, in_room=in_room)


def conducting(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a film whose conductance grows with its moisture."""
    series = log_uniform(generator, *_SERIES)
    current = log_uniform(generator, *_LOST) / series
    power, sorption = log_uniform(generator, *_CONDUCTING), log_uniform(generator, *_SORPTION)
    text = (
        f"leakage of {current * 1e6:.3g} uA at 8 kV and 50 % behind {series / 1e6:.3g} Mohm, "
        f"growing with the power {power:.2g} of the moisture, which follows in {sorption:.3g} s"
    )

    def leaking(air: Air) -> Callable[[FilmNumbers], FilmNumbers]:
        # sorption is slow compared with a run: the conductance is that at the start of the run
        moist = float(_Moisture(air, sorption).at(np.zeros(1))[0])
        conductance = current / _AT * (max(moist, 0.0) / _REFERENCE) ** power

        def on_film(numbers: FilmNumbers) -> FilmNumbers:
            return numbers.hiding(leak_series=series, leak_conductance=conductance)

        return on_film

    def in_room(air: Air) -> TruthEffect:
        return TruthEffect("humidity", "electrode", text, in_room=in_room, on_film=leaking(air))

    return TruthEffect("humidity", "electrode", text, in_room=in_room)
