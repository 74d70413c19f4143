"""Which faults of the amplifier the voltage monitor shows."""

import numpy as np
import pytest

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import lobes, play
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.truth import cases
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.monitored import with_monitor

QUIET = RigFile.model_validate({"amplifier": {"monitor_noise_mV": 0.0}})


def faults(generator, number=400):
    drawn = (
        cases.draw(seed, THESIS_FILM, THESIS_LOAD, "amplifier", generator=generator)
        for seed in range(number)
    )
    return [case.effects[0] for case in drawn]


@pytest.mark.parametrize("generator", ["first", "second"])
def test_the_seed_decides_what_the_monitor_shows_and_the_case_says_it(generator):
    drawn, again = faults(generator), faults(generator)
    assert [e.seen for e in drawn] == [e.seen for e in again]
    for effect in drawn:
        said = "(shown by the voltage monitor)" in effect.description
        assert said == effect.seen
        assert "shown by the voltage monitor)" in effect.description
    # half of those with which the thesis's runs come to their end
    static = [e for e in drawn if "too low" in e.description or "polynomial" in e.description]
    half = 0.5 * len(static)
    assert abs(sum(e.seen for e in static) - half) < 3.0 * np.sqrt(0.5 * half)


def test_a_fault_that_would_end_every_run_is_not_shown():
    def dead(time, supply, carry):
        return supply.mapped(lambda v: 0.3 * v), carry

    def weak(time, supply, carry):
        return supply.mapped(lambda v: 0.9 * v), carry

    for stage, share in ((dead, 0), (weak, 100)):
        effect = TruthEffect("amplifier", "amplifier", "weak", on_voltage=stage)
        seen = sum(with_monitor(effect, seed).seen for seed in range(200))
        assert abs(seen - share) <= 0.3 * share


def test_other_effects_are_left_as_they_are():
    case = cases.draw(12, THESIS_FILM, THESIS_LOAD)
    assert case.families == ("leakage",)
    assert "monitor" not in case.description


def first_with(words, generator, seen):
    drawn = (
        cases.draw(seed, THESIS_FILM, THESIS_LOAD, generator=generator) for seed in range(4000)
    )
    return next(
        case
        for case in drawn
        if case.families == ("amplifier",)
        and words in case.description
        and case.effects[0].seen == seen
    )


@pytest.mark.parametrize(
    ("words", "generator"),
    [
        ("offset", "first"),
        ("follows at", "first"),
        ("tanh", "second"),
        ("follows within", "second"),
    ],
)
@pytest.mark.parametrize("seen", [True, False])
def test_the_monitor_shows_the_output_or_the_command(words, generator, seen):
    case = first_with(words, generator, seen)
    address = cases.address_of(case.seed, generator)
    rig = open_simulated_rig(address, QUIET, THESIS_FILM, THESIS_LOAD)
    waveform = lobes(peaks=(8000.0,), seconds=1.0)
    record = play(rig, waveform)
    command = record.physical(rig, "voltage_command")
    monitor = record.physical(rig, "voltage_monitor")
    # the fault by its own words: at the film is what its stage makes of the command
    motion, _ = case.plant().advance(
        np.arange(command.size + 1) / waveform.rate, np.append(command, 0.0), True
    )
    first, last = motion.electricity.output
    output = first + 0.05 * (last - first)  # 50 us into 1 ms
    assert np.abs(output - command).max() > 20.0
    expected = output if seen else command
    # the converter's step is 0.3 V, and its calibration is drawn
    assert np.abs(monitor - expected).max() < 1.5
