"""Small outcomes made on paper, for the tests of reports and of the terminal."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.analysis.outcomes import (
    BranchTrial,
    Comparison,
    IdentifyOutcome,
    Published,
    ValidateOutcome,
)
from dearig.config.modelfile import ModelFile
from dearig.model.film.material import TABLE_3, THESIS_FILM, Load, Network
from dearig.model.fitting import Estimate, Identification
from dearig.model.fitting.channels import ChannelCurve, ChannelResult
from dearig.model.readings.measures import errors
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.excitation import Sequence
from dearig.model.simulation.strip import Strip

NOISE = 1e-6
TABLE_4 = ((5.8484, 6.9696), (8.8924, 2.4462), (5.8952, 3.8678), (8.7797, 5.8924), (5.9604, 3.8877))
TABLE_5 = ((2.4729, 7.4374), (2.9408, 6.7550), (3.5766, 7.0148), (7.7592, 5.6113), (8.6652, 4.6098))


def actuator_comparison(
    name: str = "train.h5", role: str = "train", seed: int = 0, rate: float = 100.0, **changes
) -> Comparison:
    """A run whose displacement follows the square of the voltage, with a drift of a few um."""
    time, voltage = Sequence.thesis(periods=1).sample(rate)
    model = 0.7e-3 * (voltage / 8e3) ** 2
    rng = np.random.default_rng(seed)
    measured = model + 3e-6 * np.sin(time) + NOISE * rng.standard_normal(time.size)
    return Comparison(
        **{
            "name": name, "kind": "actuator", "role": role, "time": time, "drive": voltage,
            "measured": measured, "model": model, "errors": errors(measured, model),
            "noise": NOISE, **changes,
        }
    )  # fmt: skip


def with_channels(comparison: Comparison, leak: float = 0.0, seed: int = 5) -> Comparison:
    """The same recording with a monitor, and a current of which ``leak`` A is not predicted."""
    rng = np.random.default_rng(seed)
    share = comparison.drive / 8e3
    predicted = {"voltage_monitor": comparison.drive, "current": 5e-6 * np.gradient(share)}
    missed = {"voltage_monitor": 0.0 * share, "current": leak * share**3}
    curves = []
    for name, unit, noise in (("voltage_monitor", "V", 1.0), ("current", "A", 2e-6)):
        measured = predicted[name] + missed[name] + noise * rng.standard_normal(share.size)
        curves.append(ChannelCurve(name, unit, comparison.time, measured, predicted[name], noise))
    channels = tuple(
        ChannelResult(c.name, c.unit, True, c.noise, 2.0 * c.rms, c.rms) for c in curves
    )
    return replace(comparison, channels=channels, curves=tuple(curves))


def film_comparison(name: str = "cycle.h5", role: str = "train", **changes) -> Comparison:
    """A cycle of stretch with a loop of stress."""
    time = np.linspace(0.0, 40.0, 801)
    stretch = 2.0 - np.abs(time - 20.0) / 20.0
    model = 40e3 * (stretch - stretch**-2.0)
    measured = model + 2e3 * np.sin(np.pi * time / 20.0)
    return Comparison(
        **{
            "name": name, "kind": "film", "role": role, "time": time, "drive": stretch,
            "measured": measured, "model": model, "errors": errors(measured, model),
            "noise": 100.0, **changes,
        }
    )  # fmt: skip


ESTIMATES = (
    Estimate("mu_0", "Pa", 83002.3, 83002.3, 83002.3, True, "follows from the rest length", False),
    Estimate("mu_1", "Pa", 20305.4, 0.0, 91481.5, False, "only an upper bound"),
    Estimate("mu_2", "Pa", 45772.4, 45650.0, 45890.0, True),
    Estimate("mu_3", "Pa", 321.197, 321.0, 390.467, True),
    Estimate("J_0", "", 1e4, 59.595, math.inf, False, "only a lower bound"),
    Estimate("J_1", "", 1e4, 0.0, math.inf, False, "not determined by these data"),
    Estimate("T_1", "s", 0.36048, 0.019546, 0.37498, False, "known only within a factor of 19.2"),
    Estimate("T_2", "s", 0.366765, 0.364832, 0.433317, True),
    Estimate("T_3", "s", 2.32465, 2.31076, 2.33359, True),
)


def fit(**changes) -> Identification:
    found = Identification(
        method="hybrid",
        model=Actuator(THESIS_FILM, Load(0.2, 0.082), TABLE_3),
        estimates=ESTIMATES,
        covariance_names=("mu_1",),
        covariance=np.eye(1),
        cost=9.0,
        correlation=40.0,
        simulations=1234,
        converged=True,
        warnings=("the residual is 3 times the noise",),
    )
    return replace(found, **changes)


def without_intervals() -> Identification:
    """As Algorithm 1 leaves it."""
    bare = tuple(
        replace(e, low=0.0, high=math.inf, determined=False, note="Algorithm 1 gives no interval")
        for e in ESTIMATES
    )
    return fit(method="de", estimates=bare, covariance=np.empty((0, 0)), covariance_names=())


def validation_runs() -> tuple[Comparison, ...]:
    runs = []
    for i, (table, published) in enumerate(
        [*(("A", p) for p in TABLE_4), *(("B", p) for p in TABLE_5)]
    ):
        row = f"f = {0.2 * (i + 1):.1f} Hz" if table == "A" else f"a = {6.0 + 0.5 * (i - 5):.1f} kV"
        runs.append(
            actuator_comparison(
                f"validation-{table.lower()}-{i}.h5",
                "validation",
                i + 1,
                50.0,
                table=table,
                row=row,
                published=Published(*published),
            )
        )
    return tuple(runs)


def identify_outcome(**changes) -> IdentifyOutcome:
    outcome = IdentifyOutcome(
        title="Thesis excitation",
        kind="actuator",
        method="hybrid",
        model=ModelFile("Thesis excitation, 3 branches", fit().model),
        fit=fit(),
        train=(actuator_comparison(),),
        validation=(),
        trials=(),
        model_path="out/model.toml",
        seconds=12.34,
        published_fit=Published(2.13, 4.07),
    )
    return replace(outcome, **changes)


def validate_outcome(**changes) -> ValidateOutcome:
    outcome = ValidateOutcome(
        "Validation", "actuator", "thesis model", "out/model.toml", validation_runs()
    )
    return replace(outcome, **changes)


TRIALS = (
    BranchTrial(1, 5.66e3, 7.3, 11.4e3, 22.1, 5340.0, False),
    BranchTrial(2, 2.53e3, 4.4, 11.2e3, 21.9, 4172.0, False),
    BranchTrial(3, 2.24e3, 4.1, 10.5e3, 20.4, 4000.0, True),
)


def film_outcome(**changes) -> IdentifyOutcome:
    strip = Strip(Network.gent((1e4, 2e4), (50.0, 60.0), (3.0,)))
    outcome = identify_outcome(
        title="Tensile tests",
        kind="film",
        fit=fit(model=strip, estimates=ESTIMATES[1:]),
        train=(film_comparison("cycle.h5"), film_comparison("again.h5")),
        validation=(film_comparison("other.h5", "validation", noise=None),),
        trials=TRIALS,
        published_fit=None,
    )
    return replace(outcome, **changes)
