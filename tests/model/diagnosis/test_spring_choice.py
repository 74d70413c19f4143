"""Which strain energy films ask for, on data made with a known one."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.model.diagnosis.spring_choice import choose_springs
from dearig.model.film.material import Network, Spring
from dearig.model.fitting import identify
from dearig.model.readings.records import FilmRecord
from dearig.model.simulation.strip import Strip

MU = 80e3


def pulled(spring: Spring, seed: int = 3) -> FilmRecord:
    """Return a pull to a stretch of 5 with noise of a thousandth of the peak."""
    time = np.linspace(0.0, 20.0, 200)
    stretch = 1.0 + 0.2 * time
    stress = Strip(Network(spring)).simulate(time, stretch).stress
    noise = 1e-3 * float(np.max(np.abs(stress)))
    stress = stress + noise * np.random.default_rng(seed).standard_normal(time.size)
    return FilmRecord("film", time, stretch, stress, noise)


def elastic(kind: str, *values: float) -> Strip:
    return Strip(Network(Spring.of(kind, 1e5, values)))


CANDIDATES = (
    elastic("neo-hookean"),
    elastic("gent", 1e4),
    elastic("yeoh", 0.0, 0.0),
    elastic("mooney-rivlin", 0.0),
    elastic("ogden", 2.0),
)


@pytest.mark.parametrize(
    "spring",
    [
        Spring(MU, kind="neo-hookean"),
        Spring(MU, 60.0),
        Spring(MU, kind="yeoh", shape=(-0.01, 4e-4)),
        Spring(MU, kind="mooney-rivlin", shape=(0.4,)),
        Spring(MU, kind="ogden", shape=(1.2,)),
    ],
)
def test_the_energy_that_made_the_data_is_the_most_probable(spring: Spring) -> None:
    trials = choose_springs([pulled(spring)], CANDIDATES)
    assert [t.kind for t in trials] == [c.network.equilibrium.kind for c in CANDIDATES]
    assert sum(t.probability for t in trials) == pytest.approx(1.0)
    best = max(trials, key=lambda t: t.probability)
    assert best.kind == spring.kind
    assert best.criterion == 0.0
    assert best.left_out_rms >= best.rms
    assert best.model.network.equilibrium.modulus == pytest.approx(MU, rel=0.02)


@pytest.mark.parametrize(
    ("spring", "start"),
    [
        (Spring(MU, 40.0, "extended-tube", (0.4, 0.3)), (1e4, 0.0, 1.0)),
        (Spring(MU, kind="ogden-two-terms", shape=(1.2, 5.0, 0.02)), (2.0, 2.0, 0.0)),
    ],
)
def test_laws_of_several_numbers_are_fitted_to_the_noise(
    spring: Spring, start: tuple[float, ...]
) -> None:
    fit = identify([pulled(spring)], elastic(spring.kind, *start), intervals=False)
    assert fit.cost < 1.3
