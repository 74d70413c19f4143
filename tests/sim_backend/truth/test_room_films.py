"""Films that follow the room, by laws that the model does not have, and the model's effects."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.drivers.settings import RoomSettings
from dearig.model.effects import EFFECTS
from dearig.model.effects_contract import values_of
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.environment import CELSIUS, HUMIDITY
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence
from dearig.sim_backend.room import AirOfRoom, still_air
from dearig.sim_backend.truth.cases import ROOM_FORMS, draw
from dearig.sim_backend.truth.effects import humidity, thermal
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.plant import TruthPlant
from tests.deep import mostly_deep

NOISE = 1e-6  # m
RATE = 50.0  # Hz
AIRS = ((17.0, 30.0), (23.0, 50.0), (29.0, 70.0))  # degC and per cent
NUMBERS = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
FORMS = {
    "moist stiffness": humidity.plasticised,
    "moist permittivity": humidity.swollen,
    "moist electrodes": humidity.losing_contact,
    "moist leakage": humidity.conducting,
    "room temperature": thermal.weathered,
}
#: Size of an effect from which a fit starts, in typical ones; 0.5 by default.
STARTS = {"moist electrodes": 4.0}


def records(form, seed: int = 0) -> list[ActuatorRecord]:
    """Runs of a film with ``form`` in still air of each kind, after long enough."""
    effect = form(np.random.default_rng(seed), THESIS_LOAD)
    noise = np.random.default_rng(seed + 1)
    time, voltage = Sequence.thesis(periods=1).sample(RATE)
    made = []
    for celsius, percent in AIRS:
        plant = TruthPlant.at_rest(NUMBERS, (effect,)).in_room(still_air(celsius, percent))
        motion, _ = plant.advance(time, voltage, False)
        readings = motion.displacement + NOISE * noise.standard_normal(time.size)
        drive = Drive(
            time, voltage, temperature=celsius - CELSIUS, humidity=0.01 * percent - HUMIDITY
        )
        made.append(ActuatorRecord(f"{percent:g} %", drive, readings, NOISE))
    return made


def cost(made: list[ActuatorRecord], effects: tuple) -> tuple[float, dict[str, float]]:
    """Return the mean square of what a fit leaves, in noises, and the numbers that it finds."""
    model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects)
    problem = Problem(made, FitLayout(model), workers=1)
    layout = problem.layout
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    for i, name in enumerate(layout.names):
        held[i] |= name.endswith("sorption_time")  # the air is still
    fit = descend(problem, layout.coordinates(layout.initial()), held, iterations=30)
    return fit.cost, dict(zip(layout.names, layout.values(fit.x), strict=True))


@pytest.mark.parametrize("name", mostly_deep(FORMS, FORMS.keys() - {"moist electrodes"}))
def test_the_effect_of_the_room_explains_a_film_of_another_law(name: str) -> None:
    made = records(FORMS[name])
    start = values_of(EFFECTS[name], STARTS.get(name, 0.5))
    with_it, found = cost(made, ((name, tuple(start.items())),))
    without, _ = cost(made, ())
    assert without > 15.0
    assert with_it < 2.0  # the laws differ
    sizes = {"moist stiffness": -1.0, "moist permittivity": 1.0, "room temperature": -1.0}
    first = EFFECTS[name].parameters[0].name
    if name in sizes:
        assert np.sign(found[f"{name}: {first}"]) == sizes[name]
    else:
        assert found[f"{name}: growth"] > 0.5


def test_a_film_remembers_the_room_of_the_hours_before() -> None:
    effect = humidity.plasticised(np.random.default_rng(5), THESIS_LOAD)
    cycling = RoomSettings(heating_percent=30.0, heating_period_min=40.0)
    rests = []
    # 45 % on the way up from 30 %, and on the way down from 60 %
    for start in (720.0, 1920.0):
        air = AirOfRoom(cycling, start)
        assert float(air.humidity(np.zeros(1))[0]) == pytest.approx(45.0)
        rests.append(TruthPlant.at_rest(NUMBERS, (effect,)).in_room(air).rest)
    still = TruthPlant.at_rest(NUMBERS, (effect,)).in_room(still_air(22.0, 45.0)).rest
    assert rests[0] + 1e-4 < still < rests[1] - 1e-4  # a moister film is softer


def test_a_run_does_not_depend_on_its_pieces() -> None:
    effect = humidity.swollen(np.random.default_rng(3), THESIS_LOAD)
    air = AirOfRoom(RoomSettings(heating_percent=30.0, heating_period_min=1.0))
    time, voltage = Sequence.thesis(periods=1).sample(RATE)
    whole, _ = TruthPlant.at_rest(NUMBERS, (effect,)).in_room(air).advance(time, voltage, False)
    plant, joined = TruthPlant.at_rest(NUMBERS, (effect,)).in_room(air), np.zeros(time.size)
    for part in (slice(0, 401), slice(400, time.size)):
        motion, plant = plant.advance(time[part], voltage[part], False)
        joined[part] = motion.displacement
    np.testing.assert_allclose(joined, whole.displacement, atol=1e-9)


def test_films_that_follow_the_room_are_drawn_by_name_only() -> None:
    drawn = {e.family for s in range(60) for e in draw(s, THESIS_FILM, THESIS_LOAD).effects}
    assert "humidity" not in drawn
    for kind, forms in ROOM_FORMS.items():
        (effect,) = draw(7, THESIS_FILM, THESIS_LOAD, kind).effects
        assert effect.in_room is not None
        assert len(forms) >= 1
