"""One model for many records: the optimum of one large least squares, and its intervals."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from dearig.model.errors import ModelError
from dearig.model.film.material import Load, Network
from dearig.model.fitting.hierarchy import fit_shared
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from tests.tools.engine import PLAIN, record_of, thesis_drive

#: Factors of mu_0 and of the permittivity of each record: a film on three days.
DAYS = ((1.0, 1.02), (0.94, 0.97), (1.05, 1.01))
OWN = ("mu_0", "permittivity")


def on_a_day(mu: float, permittivity: float):
    springs = [s.modulus for s in PLAIN.network.springs]
    network = Network.gent(
        (mu * springs[0], *springs[1:]),
        [s.limit for s in PLAIN.network.springs],
        PLAIN.network.times,
    )
    film = replace(PLAIN.film, permittivity=permittivity * PLAIN.film.permittivity)
    return replace(PLAIN, network=network, film=film)


@functools.cache
def records():
    drive = thesis_drive(rate=40.0)
    return tuple(record_of(on_a_day(*day), drive, seed=i) for i, day in enumerate(DAYS))


@functools.cache
def shared():
    return fit_shared(records(), PLAIN, OWN, workers=1)


def by_name(estimates):
    return {e.name: e.value for e in estimates}


def stacked():
    """Residuals of the same fit as one least squares over all coordinates, and the found point."""
    layout = FitLayout(PLAIN, permittivity=True)
    problems = [Problem([record], layout, workers=1) for record in records()]
    held = {e.name for e in shared().estimates[0] if e.note == "held"}
    common = [j for j, n in enumerate(layout.names) if n not in (*OWN, *held)]
    mine = [layout.names.index(n) for n in OWN]
    base = layout.coordinates(layout.initial())
    for estimate in shared().estimates[0]:
        if estimate.name in held:
            j = layout.names.index(estimate.name)
            base[j] = math.log(estimate.value)
    count, scale = len(common), np.maximum(np.abs(base), 1.0)

    def coordinates(z):
        """Coordinates of each record; the last permittivity follows from the mean."""
        own = np.append(z[count:], 0.0).reshape(len(problems), 2) * scale[mine]
        own[-1, 1] = len(problems) * base[mine[1]] - own[:-1, 1].sum()
        for i in range(len(problems)):
            x = base.copy()
            x[common], x[mine] = z[:count] * scale[common], own[i]
            yield x

    def residuals(z):
        return np.concatenate(
            [p.residuals(x) for p, x in zip(problems, coordinates(z), strict=True)]
        )

    found = [layout.coordinates(np.array([by_name(each)[n] for n in layout.names]))
             for each in shared().estimates]  # fmt: skip
    start = np.concatenate(
        [found[0][common] / scale[common], *(x[mine] / scale[mine] for x in found)]
    )[:-1]
    return residuals, start, layout, common, mine, scale


def test_the_optimum_is_that_of_one_large_least_squares() -> None:
    residuals, start, layout, common, mine, scale = stacked()
    # away from the found point, so that it does not stay there for want of a gradient
    oracle = least_squares(residuals, start * 1.002, x_scale="jac", diff_step=1e-5)
    fit = shared()
    assert fit.converged
    cost = sum(r.measured.size * c for r, c in zip(records(), fit.costs, strict=True))
    assert cost == pytest.approx(2.0 * oracle.cost, abs=0.3)
    sigma = np.sqrt(np.diag(np.linalg.inv(oracle.jac.T @ oracle.jac)))
    found = {e.name: e for e in fit.estimates[0]}
    for j, z, s in zip(common, oracle.x, sigma, strict=False):
        _agrees(found[layout.names[j]], z * scale[j], s * scale[j])
    for k in range(oracle.x.size - len(common)):
        record, place = divmod(k, 2)
        of_record = {e.name: e for e in fit.estimates[record]}
        at = len(common) + k
        _agrees(
            of_record[OWN[place]], oracle.x[at] * scale[mine[place]],
            sigma[at] * scale[mine[place]],
        )  # fmt: skip


def _agrees(estimate, coordinate: float, sigma: float) -> None:
    """The same value within a fifth of its error, and the same error but for its widening."""
    logarithmic = not estimate.name.startswith("mu")
    low, value, high = (
        math.log(v) if logarithmic else v for v in (estimate.low, estimate.value, estimate.high)
    )
    assert abs(value - coordinate) < 0.2 * sigma, estimate.name
    # noise is white here: correlation and misfit widen by chance only
    assert (high - low) / (2.0 * 1.96) == pytest.approx(sigma, rel=0.3), estimate.name


def test_own_numbers_follow_their_records_and_shared_ones_are_one() -> None:
    fit = shared()
    truths = [on_a_day(*day) for day in DAYS]
    mean = np.exp(np.mean([math.log(t.film.permittivity) for t in truths]))
    for estimates, truth in zip(fit.estimates, truths, strict=True):
        found = {e.name: e for e in estimates}
        # the scale of all moduli goes with the permittivity that is given
        factor = PLAIN.film.permittivity / mean
        wanted = truth.film.permittivity * factor
        assert found["permittivity"].value == pytest.approx(wanted, rel=0.01)
        assert found["T_1"].value == by_name(fit.estimates[0])["T_1"]
    assert fit.models[1].film.permittivity != fit.models[0].film.permittivity
    assert np.all(np.abs(fit.costs - 1.0) < 0.2)


def test_names_that_no_record_can_have_for_itself_are_refused() -> None:
    rested = replace(PLAIN, load=Load(PLAIN.load.mass, 1.1 * PLAIN.film.length))
    with pytest.raises(ModelError, match=r"mu_0 cannot be .* rest length"):
        fit_shared(records(), rested, ["mu_0"])
    with pytest.raises(ModelError, match="mu_9 cannot be"):
        fit_shared(records(), PLAIN, ["mu_9"])
