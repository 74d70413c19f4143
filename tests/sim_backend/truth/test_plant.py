"""The truth: the thesis's film when nothing is drawn, and effects where they say they act."""

import numpy as np
import pytest

from dearig.drivers.contract.rig import lobes, play
from dearig.drivers.settings import RigSettings
from dearig.model.film.material import (
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    Film,
    Load,
    Network,
    Spring,
)
from dearig.model.simulation.actuator import Actuator
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.model_plant import ModelPlant
from dearig.sim_backend.streams import Streams
from dearig.sim_backend.truth import cases
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.effects import drag, load_inertia
from dearig.sim_backend.truth.film import FilmNumbers, rest_stretch
from dearig.sim_backend.truth.plant import TruthPlant

NUMBERS = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)


def lobe_train(rate=1000.0, seconds=6.0):
    time = np.arange(round(seconds * rate) + 1) / rate
    return time, 8000.0 * np.abs(np.sin(np.pi * 0.5 * time))


def ramps(rate=4000.0):
    # short steps: at 1 kHz it is the model's kernel that follows 70 Hz ringing to 0.2 um only
    time = np.arange(round(3.0 * rate) + 1) / rate
    return time, 7000.0 * np.clip(np.minimum(time - 0.5, 2.0 - time) / 0.2, 0.0, 1.0)


@pytest.mark.parametrize("drive", [lobe_train, ramps])
@pytest.mark.parametrize("hold", [True, False])
@pytest.mark.parametrize("rest_length", [None, 0.082])
def test_without_effects_it_is_the_models_film(drive, hold, rest_length):
    load = Load(mass=0.2, rest_length=rest_length)
    time, voltage = drive()
    model, _ = ModelPlant.at_rest(Actuator(THESIS_FILM, load, TABLE_3)).advance(time, voltage, hold)
    truth, _ = TruthPlant.at_rest(FilmNumbers.of(THESIS_FILM, load, TABLE_3)).advance(
        time, voltage, hold
    )
    assert np.abs(truth.displacement - model.displacement).max() < 0.05e-6
    for row in ("output", "voltage", "charge", "step", "conduction"):
        ours, theirs = (getattr(motion.electricity, row) for motion in (truth, model))
        np.testing.assert_allclose(ours, theirs, atol=2e-5 * np.abs(theirs).max())
    # the model's is a mean over the interval, in which the film swings
    ours, theirs = (motion.electricity.charging for motion in (truth, model))
    assert np.abs(ours.mean(axis=0) - theirs[0]).max() < 0.02 * np.abs(theirs).max()
    assert truth.displacement.max() > 3e-4


def test_the_moving_mass_is_the_models_when_it_is_the_same():
    moving = TruthPlant.at_rest(NUMBERS, (load_inertia.moving(0.2),))
    effects = (("load inertia", (("moving_mass", 0.2),)),)
    model = ModelPlant.at_rest(Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects))
    time, voltage = ramps()
    expected = model.advance(time, voltage, True)[0].displacement
    assert np.abs(moving.advance(time, voltage, True)[0].displacement - expected).max() < 0.05e-6


def test_drag_takes_the_swing_out():
    generator = np.random.default_rng(0)
    effects = (load_inertia.moving(0.2), drag.mixed(generator, THESIS_LOAD))
    time, voltage = ramps()
    free = TruthPlant.at_rest(NUMBERS, effects[:1]).advance(time, voltage, True)[0].velocity
    damped = TruthPlant.at_rest(NUMBERS, effects).advance(time, voltage, True)[0].velocity
    assert np.abs(damped[10000:]).max() < 0.9 * np.abs(free[10000:]).max()
    assert effects[1].family == "drag"


def test_stages_act_on_voltage_and_on_what_the_sensor_sees_and_are_carried_on():
    def saturate(time, supply, carry):
        return supply.mapped(lambda volts: np.minimum(volts, 4000.0)), carry

    def count(time, rows, carry):
        calls = 0 if carry is None else carry
        rows[0] += 1e-3 * (calls + 1)
        return rows, calls + 1

    effects = (
        TruthEffect("amplifier", "amplifier", "saturates at 4 kV", on_voltage=saturate),
        TruthEffect("unknown", "sensor", "jumps by 1 mm a call", on_motion=count),
    )
    time, voltage = lobe_train(seconds=1.0)
    plant = TruthPlant.at_rest(NUMBERS, effects)
    first, after = plant.advance(time, voltage, True)
    plain, _ = TruthPlant.at_rest(NUMBERS).advance(time, np.minimum(voltage, 4000.0), True)
    np.testing.assert_allclose(first.displacement, plain.displacement + 1e-3, atol=1e-15)
    second, _ = after.advance(time, voltage, True)
    assert second.displacement[0] - first.displacement[-1] == pytest.approx(1e-3)


def test_the_rig_of_a_seed_has_that_film():
    rig = open_simulated_rig("sim:4", RigSettings(), THESIS_FILM, THESIS_LOAD)
    waveform = lobes(seconds=0.3)
    record = play(rig, waveform)
    reading = record.physical(rig, "displacement")
    reading = reading - reading[:20].mean()
    time = np.arange(waveform.samples) / waveform.rate
    plant = cases.draw(4, THESIS_FILM, THESIS_LOAD).plant()
    motion, _ = plant.advance(time, waveform.window(), True)
    assert (reading - motion.displacement).std() < 5e-6


def walking():
    """The first rig of which only the reading wanders."""
    rigs = (cases.draw(seed, THESIS_FILM, THESIS_LOAD) for seed in range(2000))
    return next(r for r in rigs if r.families == ("drift",) and "wanders" in r.description)


def test_a_bench_takes_another_way_in_each_run_and_the_same_in_that_run_again():
    case = walking()
    time, voltage = np.arange(2001) * 1e-2, np.zeros(2001)

    def seen(plant):
        return plant.advance(time, voltage, True)[0].displacement

    def chance(run):
        return Streams((run, case.seed)).before_run("film", 0)

    runs = [seen(case.plant().renewed(chance(run))) for run in (0, 0, 1)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.abs(runs[0] - runs[2]).max() > 1e-6
    # the film stays where it is: what is seen is the walk
    np.testing.assert_allclose(case.of_one_run(time, voltage, chance(1)), runs[2], atol=1e-12)
    # and what it is drawn by does not come after it
    again = case.plant().renewed(chance(0)).renewed(chance(1))
    np.testing.assert_array_equal(seen(again), runs[2])


def test_the_rig_draws_for_each_run_what_is_of_one_run():
    address = f"sim:{walking().seed}"
    waveform = lobes(peaks=(), quiet=6.0)

    def record(seed):
        rig = open_simulated_rig(address, RigSettings(), THESIS_FILM, THESIS_LOAD, seed=seed)
        return [play(rig, waveform).physical(rig, "displacement") for _ in range(2)]

    first, second = record(0)
    again, _ = record(0)
    np.testing.assert_array_equal(first, again)
    # slower than the laser's noise: means of a second
    apart = (first - second).reshape(-1, 1000).mean(axis=1)
    assert np.ptp(apart) > 2e-6


def test_rest_stretch_is_the_models():
    expected = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3).rest()
    assert rest_stretch(NUMBERS) == pytest.approx(expected, abs=1e-13)


def test_a_film_that_runs_away_says_so_and_stays():
    thin = Film(length=0.075, width=0.072, thickness=5e-5)
    plant = TruthPlant.at_rest(FilmNumbers.of(thin, Load(mass=0.01), TABLE_3))
    time, voltage = np.arange(3001) * 1e-3, np.full(3001, 8000.0)
    motion, after = plant.advance(time, voltage, True)
    assert motion.fault is not None
    assert np.ptp(motion.displacement[motion.fault_at :]) == 0.0
    later, _ = after.advance(time, voltage, True)
    assert later.fault is None
    assert np.ptp(later.displacement) == 0.0


@pytest.mark.parametrize(
    ("film", "load", "network", "message"),
    [
        (
            Film(0.075, 0.072, 0.001, kinematics="uniaxial"),
            THESIS_LOAD,
            TABLE_3,
            "constrained width, not uniaxial",
        ),
        (THESIS_FILM, THESIS_LOAD, Network(Spring(1e4, 50.0, "arruda-boyce")), "Gent and neo"),
        (THESIS_FILM, THESIS_LOAD, Network.gent((0.0,), (100.0,), ()), "no rest state"),
        (THESIS_FILM, Load(mass=1e3), Network.gent((1e3,), (np.inf,), ()), "no rest state"),
    ],
)
def test_films_that_it_cannot_stand_for(film, load, network, message):
    with pytest.raises(ValueError, match=message):
        TruthPlant.at_rest(FilmNumbers.of(film, load, network))
