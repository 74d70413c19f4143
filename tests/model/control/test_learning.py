"""Learning from run to run: what it reaches, what it refuses, and that it stays within limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim, lti

from dearig.acquisition.prediction import PredictedFilm
from dearig.drivers.gate import Limits, admit
from dearig.drivers.samples import Listed
from dearig.model.control import Learner, LearningSettings, TrackingTask, VoltageLimits
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Drive
from tests.tools.effect_cases import THESIS, numbers, with_effect
from tests.tools.targets import LEAD_IN, RATE, TAIL, path, task

NOISE = 1e-6


def learner(model=THESIS, target=None, **options):
    return Learner(model, task(path() if target is None else target), **options)


class Rig:
    """A film that hides something from the learner's model, read with noise."""

    def __init__(self, truth):
        self.truth = truth
        self.rng = np.random.default_rng(0)

    def play(self, teacher):
        drive = Drive(teacher.first.time, teacher.voltage, hold=True)
        answer = self.truth.simulate(drive)
        assert answer.ok
        return answer.displacement + NOISE * self.rng.standard_normal(drive.time.size)


class Swinging(Rig):
    """A film whose laser is on a stand that the film's motion swings at 4 Hz."""

    def play(self, teacher):
        omega = 2.0 * np.pi * 4.0
        stand = lti([0.4, 0.0, 0.0], [1.0, 2.0 * 0.06 * omega, omega**2])
        moved = super().play(teacher)
        return moved + lsim(stand, moved, teacher.first.time)[1]


def hiding(name, size=3.0):
    return Rig(with_effect(THESIS, name, numbers(name, size)))


def taught(rig, runs=5, **options):
    teacher = learner(**options)
    return teacher, [teacher.learn(rig.play(teacher), NOISE) for _ in range(runs)]


@pytest.mark.parametrize(
    "name",
    [
        "strain-dependent permittivity",
        "electrode resistance",
        "sensor lag",
        "slow branch",
        "leakage",
    ],
)
def test_the_error_falls_to_the_noise(name):
    _, lessons = taught(hiding(name))
    assert lessons[0].rms > 2.0 * NOISE
    assert lessons[-1].rms < 1.25 * NOISE
    assert lessons[0].learned
    assert lessons[0].contraction <= LearningSettings().contraction


@pytest.mark.parametrize("name", ["dry friction", "elastoplastic hysteresis", "Mullins softening"])
def test_what_a_linear_filter_does_not_describe_is_learned_in_part(name):
    teacher, lessons = taught(hiding(name))
    assert teacher.best_rms < 0.4 * lessons[0].rms


def test_a_model_that_knows_the_effect_needs_no_learning():
    rig = hiding("slow branch")
    _, lessons = taught(rig, runs=1, model=rig.truth)
    assert lessons[0].rms < 1.1 * NOISE


def test_a_wrong_sign_of_the_laser_teaches_nothing():
    teacher = learner()
    before = teacher.voltage.copy()
    lesson = teacher.learn(-Rig(THESIS).play(teacher), NOISE)
    assert not lesson.learned
    assert "sign of the laser" in lesson.notes[-1]
    np.testing.assert_array_equal(teacher.voltage, before)


def test_a_film_that_returns_more_slowly_than_the_model_is_said_to():
    rig = hiding("slow branch", 20.0)
    _, lessons = taught(rig, target=path(offset=300e-6, seconds=5.0), runs=4)
    assert any("no voltage changes" in note for note in lessons[-1].notes)
    assert lessons[-1].rms < 2.0 * NOISE  # no error is counted there


def test_readings_without_a_value_are_left_out():
    rig, teacher = hiding("leakage"), learner()
    for _ in range(4):
        reading = rig.play(teacher)
        reading[300:360] = np.nan
        reading[500] += 1e-3
        lesson = teacher.learn(reading, NOISE)
    assert "1 spikes are left out" in lesson.notes
    assert lesson.rms < 1.5 * NOISE
    masked = np.arange(reading.size) < reading.size // 2
    assert lesson.samples > teacher.learn(rig.play(teacher), NOISE, masked).samples


def test_a_laser_that_stands_still_teaches_nothing():
    teacher = learner()
    lesson = teacher.learn(np.full(teacher.first.time.size, 1e-6), NOISE)
    assert not lesson.learned
    assert "too few readings" in lesson.notes[-1]


def test_a_slip_of_one_run_is_not_learned():
    rig, teacher = hiding("leakage"), learner()
    for _ in range(3):
        quiet = teacher.learn(rig.play(teacher), NOISE)
    reading = rig.play(teacher)
    reading[reading.size // 2 :] += 6e-6
    shifted = teacher.learn(reading, NOISE)
    assert shifted.rms > 2.0 * quiet.rms
    assert teacher.learn(rig.play(teacher), NOISE).rms < 1.3 * quiet.rms


def test_a_run_that_got_worse_is_stepped_back_from():
    rig, teacher = hiding("dry friction"), learner()
    first = teacher.learn(rig.play(teacher), NOISE)
    second = teacher.learn(rig.play(teacher), NOISE)
    best = teacher.best_rms
    worse = teacher.learn(rig.play(teacher) * 1.2, NOISE)
    assert worse.rms > second.rms
    assert "stepped back" in " ".join(worse.notes)
    assert worse.edge < second.edge
    assert teacher.best_rms == best < first.rms


def test_two_steps_that_fail_end_the_learning():
    rig, teacher = hiding("dry friction"), learner()
    teacher.learn(rig.play(teacher), NOISE)
    best = teacher.voltage.copy()
    teacher.learn(rig.play(teacher), NOISE)
    for _ in range(2):
        assert not teacher.settled
        teacher.learn(rig.play(teacher) * 1.2, NOISE)
    assert teacher.settled
    np.testing.assert_array_equal(teacher.voltage, best)


def test_a_voltage_whose_error_is_noise_is_kept():
    rig, teacher = hiding("slow branch"), learner()
    teacher.learn(rig.play(teacher), NOISE)
    found = teacher.voltage
    kept = teacher.learn(rig.play(teacher), NOISE)
    assert not kept.learned
    assert "is noise" in kept.notes[-1]
    np.testing.assert_array_equal(kept.voltage, found)
    # also after a run that something else has spoiled
    spoilt = teacher.learn(rig.play(teacher) * 1.2, NOISE)
    np.testing.assert_array_equal(spoilt.voltage, found)


def test_a_drift_that_does_not_repeat_ends_the_learning():
    rig, teacher = Rig(THESIS), learner()
    first = teacher.voltage.copy()
    drift = 2e-6 * np.sin(np.linspace(0.0, np.pi, first.size))
    assert teacher.learn(rig.play(teacher) + drift, NOISE).learned
    assert not np.array_equal(teacher.voltage, first)
    kept = teacher.learn(rig.play(teacher), NOISE)  # the learned drift is an error now
    assert not kept.learned
    assert "not made the error significantly smaller" in teacher.settled
    np.testing.assert_array_equal(kept.voltage, first)
    teacher.learn(rig.play(teacher) + drift, NOISE)
    np.testing.assert_array_equal(teacher.voltage, first)


def test_an_uncertain_model_learns_less():
    rig = hiding("linear drag")
    heavier = with_effect(THESIS, "load inertia", numbers("load inertia", 4.0))
    _, (sure,) = taught(rig, runs=1)
    _, (unsure,) = taught(rig, runs=1, alternatives=(heavier,))
    assert unsure.edge < sure.edge


def test_noise_is_above_zero():
    with pytest.raises(ModelError, match="noise"):
        learner().learn(path(), 0.0)


def test_what_a_gap_has_hidden_is_learned_from_the_next_run():
    rig, teacher = Rig(THESIS), learner()
    at = np.arange(teacher.first.time.size) / teacher.first.time.size
    lacking = 3e-6 * np.sin(3.0 * np.pi * at) + 20e-6 * np.exp(-(((at - 0.5) / 0.05) ** 2))
    first = rig.play(teacher) + lacking
    first[np.abs(at - 0.5) < 0.2] = np.nan
    teacher.learn(first, NOISE)
    # its error is larger only where the first run was not measured
    second = teacher.learn(rig.play(teacher) + lacking, NOISE)
    assert second.learned
    assert not any("stepped back" in note for note in second.notes)
    assert teacher.learn(rig.play(teacher) + lacking, NOISE).rms < 0.3 * second.rms


def test_a_spike_is_no_reading_of_a_film_that_was_let_go():
    rig, teacher = hiding("leakage"), learner()
    teacher.learn(rig.play(teacher), NOISE)
    reading = rig.play(teacher)
    sound = teacher.first.time.size
    reading[:: round(0.1 * RATE)] += 200e-6
    lesson = teacher.learn(reading, NOISE)
    assert not any("no voltage changes" in note for note in lesson.notes)
    assert lesson.samples > 0.7 * sound


STEP = 1.22e-6  # m: of a converter of 16 bits over 80 mm


def test_the_zero_of_a_coarse_reading_is_within_a_tenth_of_its_step():
    rig, teacher = Rig(THESIS), learner()
    errors = []
    for part in (0.0, 0.4):
        # the film hangs anywhere between two steps
        reading = STEP * np.round((rig.play(teacher) + part * STEP) / STEP)
        errors.append(teacher.learn(reading, NOISE).rms)
    assert max(errors) < 1.15 * np.hypot(NOISE, STEP / np.sqrt(12.0))


def test_a_coarse_reading_that_stands_still_at_rest_is_not_sorted_out():
    rig, teacher = hiding("slow branch"), learner()
    coarse = 6e-6
    for _ in range(3):
        reading = coarse * np.round(rig.play(teacher) / coarse)
        lesson = teacher.learn(reading, 1e-7)  # the noise at rest is unknown: it never changes
    assert not any("left out" in note for note in lesson.notes)
    assert teacher.best_rms < 1.3 * coarse / np.sqrt(12.0)


@pytest.mark.parametrize("contraction", [0.3, 0.8])
def test_the_band_that_is_learned_is_the_widest_that_contracts(contraction: float):
    # a mass that the model lacks: the film responds ever more differently towards its resonance
    rig = hiding("load inertia", 2.0)
    _, (lesson,) = taught(rig, runs=1, settings=LearningSettings(contraction=contraction))
    assert lesson.contraction == pytest.approx(contraction)


def test_a_resonance_that_the_model_lacks_is_learned_by_the_measured_response():
    # at its resonance the reading is several times the model's, and a quarter of a period late
    _, lessons = taught(Swinging(THESIS), target=path(frequency=4.0, seconds=12.0), runs=4)
    assert lessons[0].rms > 50.0 * NOISE
    assert min(lesson.rms for lesson in lessons) < 0.1 * lessons[0].rms


def test_independent_directions_of_a_model_add_in_squares():
    rig = hiding("linear drag")
    lagging = with_effect(THESIS, "sensor lag", numbers("sensor lag", 1.0))
    (one,), (two,), (four,) = (
        taught(rig, runs=1, alternatives=(lagging,) * many)[1] for many in (1, 2, 4)
    )
    assert one.edge > two.edge > four.edge > 0.0


# ---------------------------------------------------------------- no reading passes a limit

#: Gates whose voltage, slew and field the path would pass, and one that it does not touch.
_GATES = {
    "wide": Limits(0.0, 5e3, 2e5, 6e6, 1e3, 1e3, 600.0),
    "voltage": Limits(0.0, 3e3, 2e5, 6e6, 1e3, 1e3, 600.0),
    "slew": Limits(0.0, 5e3, 3e3, 6e6, 1e3, 1e3, 600.0),
    "field": Limits(0.0, 5e3, 2e5, 2.5e6, 1e3, 1e3, 600.0),
}
_SHORT = path(seconds=3.0, amplitude=80e-6, offset=350e-6)
_ANY = st.floats(allow_nan=True, allow_infinity=True)


def _spoil(reading, kind, values, rng):
    n = reading.size
    part = slice(*np.sort(rng.integers(0, n + 1, 2)))
    if kind == "nan":
        reading[rng.random(n) < 0.5] = np.nan
    elif kind == "spikes":
        reading[rng.integers(0, n, 40)] = rng.choice([1e300, -1e300, 1e-3, np.inf], 40)
    elif kind == "stuck":
        reading[n // 3 :] = reading[n // 3]
    elif kind == "flipped":
        reading *= -1.0
    elif kind == "large":
        reading *= 1e3 * rng.standard_normal()
    elif kind == "noise":
        reading += 1e-4 * rng.standard_normal(n)
    elif kind == "late":
        reading = np.roll(reading, n // 7)
    elif kind == "ended":
        reading = reading[: rng.integers(0, n)]
    elif kind == "anything":  # numbers of any size over a part of the run
        reading[part] = np.resize(values, reading[part].size)
    elif kind == "moved":  # as a film may move, a thousand times as far
        reading[part] += 0.4 * np.tanh(np.resize(np.nan_to_num(values), reading[part].size))
    elif kind == "below":  # the film never comes near its target: more and more is asked for
        reading[part] -= 350e-6
    return reading


_KINDS = (
    "nan", "spikes", "stuck", "flipped", "large", "noise", "late", "ended", "anything", "moved",
    "below", "sound",
)  # fmt: skip


@settings(max_examples=10, deadline=None)
@given(
    st.sampled_from(sorted(_GATES)),
    st.lists(
        st.tuples(st.lists(st.sampled_from(_KINDS), min_size=1, max_size=2),
                  st.floats(-12.0, -2.0), st.booleans()),
        min_size=1, max_size=3,
    ),
    st.lists(_ANY, min_size=1, max_size=5),
    st.integers(0, 2**31),
)  # fmt: skip
def test_no_reading_makes_a_voltage_beyond_a_limit(gate, runs, values, seed):
    rng, limits = np.random.default_rng(seed), _GATES[gate]
    within = VoltageLimits(limits.voltage_max, limits.slew, limits.field)
    teacher = Learner(THESIS, TrackingTask(_SHORT, RATE, within, LEAD_IN, TAIL))
    rig = hiding("slow branch")
    for kinds, noise, masked in runs:
        reading = rig.play(teacher)
        valid = rng.random(reading.size) < 0.9 if masked else None
        for kind in kinds:
            reading = _spoil(reading, kind, values, rng)
        voltage = teacher.learn(reading, 10.0**noise, valid).voltage
        predicted = PredictedFilm(THESIS, voltage.size, RATE, limits, "", None)
        admit(Listed(voltage), RATE, limits, predicted)  # raises where a limit is passed
        assert voltage[0] == voltage[-1] == 0.0
