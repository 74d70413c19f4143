"""Diagnoses made on paper, for the tests of what is told of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, Evaluation, SeparatingExperiment
from dearig.config.modelfile import ModelFile
from dearig.model.diagnosis.channels import Denial
from dearig.model.diagnosis.results import (
    Candidate,
    Diagnosis,
    Round,
    Stage,
    Step,
)
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.fitting import Estimate
from dearig.model.fitting.channels import ChannelResult
from dearig.model.readings.measures import errors
from dearig.model.residual import Dependence, MissingStress, Signature, Unnamed
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from tests.tools.reports import (
    ESTIMATES,
    NOISE,
    actuator_comparison,
    film_comparison,
    with_channels,
)

LAG = (("sensor lag", (("time_constant", 9.5e-3),)),)
BASE = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
LAGGED = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, LAG)
RIVAL = Actuator(
    THESIS_FILM, THESIS_LOAD, TABLE_3, (("amplifier lag", (("time_constant", 9.4e-3),)),)
)
NAMED = Estimate("sensor lag: time_constant", "s", 9.5e-3, 9.1e-3, 9.9e-3, True)
TIME_CONSTANT = Estimate("time_constant", "s", 9.5e-3, 9.1e-3, 9.9e-3, True)


QUANTITIES = (
    ("voltage squared", "kV^2"), ("displacement", "mm"), ("rate", "mm/s"), ("time", "s"),
)  # fmt: skip


def stage(model: Actuator | Strip, rms: float, noise: float = NOISE, estimates=()) -> Stage:
    return Stage(
        model, (rms / noise) ** 2, rms, 1.1 * rms, 4.4 * rms, 1e3 * rms / noise, tuple(estimates)
    )


def signature(comparison: Comparison, is_noise: bool) -> Signature:
    """The residual of a comparison, with what it goes with made up to look like a lag."""
    residual = comparison.measured - comparison.model
    step = float(np.median(np.diff(comparison.time)))
    power = np.abs(np.fft.rfft(residual)) ** 2 * 2.0 * step / residual.size
    at = np.linspace(0.0, 64.0, 24)
    rms = comparison.errors.rms
    loop = 0.0 if is_noise else rms
    loading = loop * np.sin(np.pi * at / 64.0)
    loading[20:] = np.nan
    return Signature(
        record=comparison.name,
        time=comparison.time,
        residual=residual,
        noise=comparison.noise or rms,
        rms=rms,
        ljung_box_p=0.4 if is_noise else 0.0,
        runs_p=0.2 if is_noise else 1e-9,
        correlation_time=step if is_noise else 0.35,
        frequency=np.fft.rfftfreq(residual.size, step)[1:],
        density=power[1:],
        floor_density=2.0 * (comparison.noise or rms) ** 2 * step,
        dependences=tuple(
            Dependence(name, unit, at, loading, -loading, np.full(24, 0.1 * rms), 0.37)
            for name, unit in QUANTITIES
        ),
        loading_less_unloading=2.0 * loop,
        first_less_repeats=0.0,
        is_noise=is_noise,
        words=("3.1 um RMS, 3.1 times the noise floor of 1 um",),
    )  # fmt: skip


def missing(comparison: Comparison, scale: float) -> MissingStress:
    time = comparison.time
    stretch = 1.09 + 0.01 * np.sin(time) ** 2
    rate = np.gradient(stretch, time)
    return MissingStress(
        comparison.name, time, scale * rate, stretch, rate, 8e3 * np.sin(time) ** 2, 10.0, 2.7e3
    )


def candidate(effect: str, family: str, verdict: str, behind: float, gained: float) -> Candidate:
    return Candidate(
        effect, family, "sensor", stage(LAGGED, 3e-6), 0.5 * gained, gained, 900.0 - behind,
        behind, verdict, "it hides behind the baseline" if verdict == "chosen" else "",
    )  # fmt: skip


ROUND = Round(
    (),
    (
        candidate("sensor lag", "sensor_lag", "chosen", 0.0, 0.89),
        candidate("amplifier lag", "amplifier", "indistinguishable", 2.5, 0.885),
        candidate("linear drag", "drag", "better", 420.0, 0.4),
        *(candidate(f"{n} drift", "drift", "worthless", 905.0 + n, 0.001 * n) for n in range(9)),
    ),
    "sensor lag",
    "sensor lag gains 900 of the information criterion",
)
LAST = Round(("sensor lag",), (), None, "no effect explains significantly more")

STEP = Step(
    "sensor lag", "sensor_lag", "sensor", stage(LAGGED, 1.02e-6), (TIME_CONSTANT,),
    ("amplifier",), ("without it the residual is 3.1 times the noise, with it 1.02 times",),
    (("criterion_without", 900.0),),
)  # fmt: skip


def after_of(comparison: Comparison, seed: int, rms: float | None = None) -> Comparison:
    """The same recording, whose model leaves nothing but noise."""
    rng = np.random.default_rng(seed)
    size = rms or comparison.noise or 1.0
    model = comparison.measured - size * rng.standard_normal(comparison.time.size)
    return replace(comparison, model=model, errors=errors(comparison.measured, model))


def _stands(
    train: tuple[Comparison, ...], others: tuple[Comparison, ...]
) -> tuple[Evaluation, Evaluation]:
    return Evaluation((), train, others), Evaluation(
        ("sensor lag",),
        tuple(after_of(c, i) for i, c in enumerate(train)),
        tuple(after_of(c, i + 10) for i, c in enumerate(others)),
    )


EXPERIMENT = SeparatingExperiment(
    name="fast lobes",
    sequence='name = "fast lobes"\n[[segment]]\nkind = "hold"\nduration_s = 1.0\n',
    rivals=("sensor lag", "amplifier lag"),
    separates=("sensor_lag", "amplifier"),
    separation=4.25,
    closest=("sensor lag", "amplifier lag"),
    seconds=11.0,
    tried=(("fast lobes", 4.25, 11.0), ("rich", 2.1, 45.0)),
)


def finding(**changes) -> Diagnosis:
    train = actuator_comparison()
    late = after_of(train, 0)
    found = Diagnosis(
        verdict="explained",
        baseline=stage(BASE, train.errors.rms),
        rounds=(ROUND, LAST),
        steps=(STEP,),
        final=stage(LAGGED, 1.02e-6, estimates=(*ESTIMATES, NAMED)),
        before=(signature(train, False),),
        after=(signature(late, True),),
        missing_before=(missing(train, 900.0),),
        missing_after=(missing(train, 9.0),),
        unnamed=None,
        rivals=(("amplifier", RIVAL),),
        simulations=4321,
    )  # fmt: skip
    return replace(found, **changes)


def diagnose_outcome(**changes) -> DiagnoseOutcome:
    train = actuator_comparison()
    others = tuple(actuator_comparison(f"validation-{i}.h5", "validation", i + 1) for i in range(2))
    outcome = DiagnoseOutcome(
        title="thesis identification",
        kind="actuator",
        drive="command",
        model=ModelFile("thesis identification, with leakage", BASE),
        finding=finding(),
        stands=_stands((train,), others),
        noise=NOISE,
        experiment=EXPERIMENT,
        experiment_text="'fast lobes' separates best among 14 excitations within the rig's limits",
        quality=("train.h5: the sensor is clipped at 0.7 mm from sample 400 (4 s) on",),
        model_path="out/model.toml",
        seconds=12.3,
    )
    return replace(outcome, **changes)


def _odds(*values: float) -> tuple[tuple[str, float], ...]:
    return tuple(zip(("displacement", "voltage_monitor", "current"), values, strict=True))


def electric_outcome() -> DiagnoseOutcome:
    """A diagnosis whose recordings have a voltage monitor and a current."""
    outcome = diagnose_outcome()
    before, after = (
        replace(
            stand,
            train=tuple(with_channels(c, leak) for c in stand.train),
            validation=tuple(with_channels(c, leak) for c in stand.validation),
        )
        for stand, leak in ((outcome.before, 30e-6), (outcome.after, 0.0))
    )
    left = ChannelResult("voltage_monitor", "V", used=False, reason="not recorded")
    return replace(
        outcome,
        stands=(before, after),
        finding=finding(
            channels=(*after.train[0].channels[1:], left),
            channel_evidence=(
                ("leakage", _odds(840.0, -2.0, 46e3)),
                ("amplifier", _odds(851.0, -9e5, 12.0)),
                ("permittivity", _odds(846.0, 0.0, -5.0)),
            ),
            denials=(
                Denial("amplifier lag", "amplifier", "voltage_monitor", 177.0, 1.0, 1.0, "V", 4e3),
            ),
        ),
    )  # fmt: skip


def nothing_missing() -> DiagnoseOutcome:
    """A diagnosis that found nothing, without untouched recordings."""
    outcome = diagnose_outcome()
    clean = after_of(outcome.before.train[0], 3)
    stand = Evaluation((), (clean,), ())
    fitted = stage(BASE, 1e-6, estimates=ESTIMATES)
    return replace(
        outcome,
        stands=(stand, stand),
        quality=(),
        experiment=None,
        experiment_text="No other family explains these data as well",
        finding=finding(
            verdict="nothing_missing", baseline=fitted, final=fitted, steps=(), rivals=(),
            rounds=(replace(LAST, base=()),), before=(signature(clean, True),),
            after=(signature(clean, True),),
        ),
    )  # fmt: skip


def film_diagnosis() -> DiagnoseOutcome:
    """A diagnosis of films that left something over."""
    train, other = film_comparison("cycle.h5"), film_comparison("other.h5", "validation")
    strip = Strip(TABLE_3)
    curved = Strip(TABLE_3, effects=(("Mullins softening", (("softening", 0.1), ("width", 0.3))),))
    step = replace(
        STEP, effect="Mullins softening", family="softening", acts_on="film stress",
        stage=stage(curved, 700.0, 100.0), indistinguishable_from=(),
        estimates=(Estimate("softening", "", 0.1, 0.08, 0.12, True),),
    )  # fmt: skip
    unnamed = Unnamed("film stress", "12 kPa (stretch - 1.5)^2", "It comes late in the record.")
    return diagnose_outcome(
        kind="film",
        stands=_stands((train,), (other,)),
        noise=100.0,
        experiment=None,
        experiment_text="The recordings are of films: sequences of voltage do not apply.",
        quality=(),
        finding=finding(
            verdict="partly_explained", baseline=stage(strip, 1.4e3, 100.0), steps=(step,),
            final=stage(curved, 700.0, 100.0, ESTIMATES[1:]), before=(signature(train, False),),
            after=(signature(after_of(train, 1), False),), unnamed=unnamed, rivals=(),
            missing_before=(missing(train, 900.0),), missing_after=(), notes=("a note",),
        ),
    )  # fmt: skip
