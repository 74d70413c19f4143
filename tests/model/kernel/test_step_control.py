"""Steps by fidelity: how far they are from careful ones, and how many there are."""

from dataclasses import replace

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.effects import EFFECTS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive, reading_of, readings_of
from tests.tools.engine import typical
from tests.tools.film_drives import LENGTH, ticks


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (("linear drag", (("drag", 30.0),)),),
        (("Mullins softening", (("softening", 0.01), ("width", 0.5))),),
        (("distributed hysteresis", (("stiffness", 1e4), ("reach", 0.02), ("spread", 1.0))),),
        (("electrode resistance", (("resistance", 2e7),)),),
        (
            (
                "first-loading damage",
                (("softening", 0.01), ("reach", 0.02), ("exponent", 1.5), ("breadth", 0.3)),
            ),
        ),
    ],
    ids=lambda e: e[0][0] if e else "plain",
)
def test_a_quick_step_may_be_longer_than_the_ringing(effects):
    # 70 Hz after each step of the voltage, and 5 ms from sample to sample
    time = ticks(6.0, 5e-3)
    voltage = np.interp(time, [1.0, 1.02, 3.0, 3.02, 4.0, 4.02], [0.0, 8e3, 8e3, 3e3, 3e3, 5e3])
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects)
    c = actuator.coefficients()
    drive = Drive(time, voltage, hold=True)
    quick, status = reading_of(c, LENGTH, drive, fidelity=kernel.QUICK)
    fine, _ = reading_of(c, LENGTH, drive)
    assert status == kernel.OK
    rang = np.diff(fine, 2)[(time[2:] > 1.02) & (time[2:] < 1.3)]
    assert np.abs(rang).max() > 5e-6
    assert np.sqrt(np.mean((quick - fine) ** 2)) < 1e-3 * np.std(fine)


@pytest.mark.parametrize(
    "effects",
    [
        (("mixed drag", (("drag", 3.1e3), ("quadratic", 2.9e4))),),
        (("power-law drag", (("drag", 630.0), ("exponent", 1.37))),),
    ],
    ids=lambda e: e[0][0],
)
def test_quick_steps_resolve_a_drag_that_grows_with_the_rate(effects):
    # lobes that come ever sooner, up to ten a second
    time = ticks(8.0, 5e-3)
    drive = Drive(time, 7e3 * np.abs(np.sin(np.pi * (0.5 * time + 0.6 * time**2))), hold=True)
    c = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects).coefficients()
    careful, status = reading_of(c, LENGTH, drive)
    assert status == kernel.OK
    quick, _ = reading_of(c, LENGTH, drive, fidelity=kernel.QUICK)
    # what it misses would be told for an effect by which steps are shorter
    assert np.abs(quick - careful).max() < 0.2e-6


def test_growing_drags_take_the_steps_that_their_motion_needs():
    """Under steps, and under lobes that come ever sooner, against a tenth of the step."""
    time = ticks(8.0, 5e-3)
    steps = np.select([time < 1.0, time < 3.0, time < 5.0], [0.0, 3e3, 8e3], 2e3)
    sooner = 7e3 * np.abs(np.sin(np.pi * (0.5 * time + 0.6 * time**2)))
    fine = ticks(8.0, 5e-4)
    taken = 0
    for drag, exponent in ((60.0, 2.0), (2240.0, 1.5), (1e4, 3.0)):
        effects = (("power-law drag", (("drag", drag), ("exponent", exponent))),)
        c = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects).coefficients()
        for voltage in (steps, sooner):
            held = voltage[np.minimum(np.arange(fine.size) // 10, time.size - 1)]
            close, status = reading_of(c, LENGTH, Drive(fine, held, hold=True))
            assert status == kernel.OK
            for fidelity, off in ((kernel.CAREFUL, 0.15e-6), (kernel.QUICK, 1.2e-6)):
                drive = Drive(time, voltage, hold=True)
                (got,), _, count = readings_of(c[None], LENGTH, drive, fidelity=fidelity)
                assert np.abs(got - close[::10]).max() < off
                taken += count
    # what a strong drag makes small needs few steps to be seen
    assert taken < 210 * time.size


HYSTERETIC = [e.name for e in EFFECTS.values() if e.is_hysteretic]
SOFTENING = [name for name in HYSTERETIC if EFFECTS[name].family == "softening"]
#: Those whose one amplitude is called softening.
SIMPLY_SOFTENING = [name for name in SOFTENING if not EFFECTS[name].is_general]


def off_by(fidelity, effects, drive):
    """RMS of what ``fidelity`` gets wrong, and of what the effects do."""
    plain = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    c = replace(plain, effects=effects).coefficients()
    careful, status = reading_of(c, LENGTH, drive)
    assert status == kernel.OK
    rough, _ = reading_of(c, LENGTH, drive, fidelity=fidelity)
    without, _ = reading_of(plain.coefficients(), LENGTH, drive)
    return np.sqrt(np.mean((rough - careful) ** 2)), np.sqrt(np.mean((careful - without) ** 2))


@pytest.mark.parametrize("name", [name for name in HYSTERETIC if name not in SOFTENING])
def test_rough_steps_are_good_to_a_tenth_of_what_a_hysteretic_effect_does(name):
    time = ticks(8.0, 5e-3)
    drive = Drive(time, 7e3 * np.sin(np.pi * 0.5 * time) ** 2, hold=True)
    off, does = off_by(kernel.ROUGH, (typical(name),), drive)
    # as measured, rounded up
    assert 0.0 < off < 0.11 * does
    # a search that chooses is careful there
    assert off_by(kernel.QUICK, (typical(name),), drive)[0] == 0.0


STEPPED = [0.0, 8e3, 8e3, 3e3, 3e3, 5e3]


@pytest.mark.parametrize("size", [0.002, 0.02, -0.005])
@pytest.mark.parametrize("name", SIMPLY_SOFTENING)
@pytest.mark.parametrize(("fidelity", "ringing"), [(kernel.QUICK, 0.01), (kernel.ROUGH, 0.02)])
def test_softening_is_resolved_while_the_film_rings(fidelity, ringing, name, size):
    time = ticks(6.0, 5e-3)
    effects = ((name, tuple({**dict(typical(name)[1]), "softening": size}.items())),)
    lobes = Drive(time, 7e3 * np.sin(np.pi * 0.5 * time) ** 2, hold=True)
    steps = np.interp(time, [1.0, 1.02, 3.0, 3.02, 4.0, 4.02], STEPPED)
    for drive, part in ((lobes, 0.005), (Drive(time, steps, hold=True), ringing)):
        off, does = off_by(fidelity, effects, drive)
        assert off < part * does
