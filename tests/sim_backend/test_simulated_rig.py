"""The simulated rig: the contract of every rig, its timing, its clock, its faults."""

import math
import threading
import time as real_time

import numpy as np
import pytest

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import (
    LIMITS,
    RATE,
    RigContract,
    begin,
    drain,
    foreseen,
    lobes,
    play,
)
from dearig.drivers.errors import AddressError, RigError, RigStateError
from dearig.drivers.gate import admit
from dearig.drivers.rig import RigState
from dearig.drivers.settings import LaserSettings, RigSettings, ThermometerSettings
from dearig.model import kernel
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Film, Load, Network
from dearig.model.simulation.actuator import NO_AIR, Actuator, at_rest, initial_state
from dearig.sim_backend.card import INPUT_OVERWRITTEN
from dearig.sim_backend.clock import ManualClock, PacedClock
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.signal_path import CHUNK


def open_rig(address="sim", settings=None, **options):
    return open_simulated_rig(
        address, settings or RigSettings(), THESIS_FILM, THESIS_LOAD, **options
    )


class TestSimulatedRig(RigContract):
    def open_rig(self, *, block_samples=None, seed=0):
        return open_rig(block_samples=block_samples, seed=seed)


class TestRigThatHidesSomething(RigContract):
    def open_rig(self, *, block_samples=None, seed=0):
        return open_rig("sim:7", block_samples=block_samples, seed=seed)


def quiet_settings(averaging=16, sampling_us=20.0, rate=RATE, **more) -> RigSettings:
    """A rig without noise, whose laser resolves a tenth of a micrometre."""
    return RigFile.model_validate(
        {
            "laser": {
                "noise_um": 0.0,
                "resolution_um": 0.0,
                "range_mm": 4.0,
                "mm_per_V": 0.4,
                "rest_position_mm": -1.0,
                "averaging": averaging,
                "sampling_us": sampling_us,
                **more,
            },
            "amplifier": {"monitor_noise_mV": 0.0},
            "card": {"sample_rate_Hz": rate},
        }
    )


def expected_displacement(voltage, rate, shift):
    """The model under the held voltage, at every tick plus ``shift`` s, with its velocity."""
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    ticks = np.arange(voltage.size + 1) / rate
    wanted = ticks[:-1] + shift
    held = np.append(voltage, 0.0)
    fine = np.arange(0.0, ticks[-1], 2.5e-4)  # the kernel's own step is too long for 70 Hz ringing
    time = np.union1d(np.union1d(ticks, fine), wanted[wanted >= 0.0])
    time = time[np.concatenate(([True], np.diff(time) > 1e-10))]
    at_time = held[np.searchsorted(ticks, time + 1e-9, side="right") - 1]
    c = actuator.coefficients()
    _, rest = at_rest(c)
    stretch, speed = np.empty(time.size), np.empty(time.size)
    status, _, _ = kernel.drive_by_voltage(
        c, time, at_time, at_time, NO_AIR, initial_state(c, rest), stretch, speed
    )
    assert status == kernel.OK
    at = np.searchsorted(time, np.maximum(wanted, 0.0) - 1e-9)
    length = THESIS_FILM.length
    return (stretch[at] - rest) * length, speed[at] * length


@pytest.mark.parametrize(
    ("averaging", "sampling_us", "rate"),
    [
        (1, 20.0, 1000.0),
        (16, 20.0, 1000.0),
        (64, 2.55, 1000.0),
        (64, 100.0, 1000.0),
        (16, 20.0, 100.0),
        (4, 20.0, 5000.0),
    ],
)
def test_reading_is_the_model_at_tick_plus_skew_minus_delay(averaging, sampling_us, rate):
    waveform = lobes(peaks=(6000.0, 8000.0), seconds=1.0, rate=rate)
    rig = open_rig(settings=quiet_settings(averaging, sampling_us, rate))
    record = play(rig, waveform)
    channel = rig.identify().channels[3]
    reading = channel.scaling.physical(record.counts[3]) + 1e-3
    command = record.physical(rig, "voltage_command")
    model, speed = expected_displacement(command, rate, channel.skew - channel.delay)
    error = reading - model
    assert abs(error.mean()) < 0.02e-6
    # the amplifier makes the film 6.4 us late, and the laser's clock stands anywhere in its period;
    # half a sample would be hundreds of microseconds
    lag = -np.dot(error, speed) / np.dot(speed, speed)
    assert lag == pytest.approx(6.4e-6, abs=5e-6 + 0.5e-6 * sampling_us)
    assert np.abs(error).max() < 0.1e-6 + (6.4e-6 + 0.5e-6 * sampling_us) * np.abs(speed).max()


def test_current_is_charge_and_discharge_of_the_film():
    rig = open_rig(settings=quiet_settings())
    waveform = lobes(peaks=(8000.0,), seconds=1.0)
    record = play(rig, waveform)
    current = record.physical(rig, "current_monitor")
    # between the steps of the output it has died away, but for the film that grows and shrinks
    assert np.abs(current).max() < 1e-4


def test_thermometer_is_a_channel_when_there_is_one():
    settings = RigSettings(thermometer=ThermometerSettings(room_celsius=25.0))
    rig = open_rig(settings=settings)
    record = play(rig, lobes())
    assert record.counts.shape[0] == 5
    temperature = record.physical(rig, "temperature")
    assert temperature.mean() == pytest.approx(298.15, abs=0.05)
    assert 0.005 < temperature.std() < 0.02


def test_fifth_channel_leaves_the_others_as_they_are():
    plain = play(open_rig(), lobes())
    warm = play(open_rig(settings=RigSettings(thermometer=ThermometerSettings())), lobes())
    np.testing.assert_array_equal(plain.counts[:3], warm.counts[:3])


@pytest.mark.parametrize("stop_after", [0, 1000, CHUNK - 96, CHUNK, CHUNK + 4])
def test_what_came_before_a_stop_is_what_comes_without_it(stop_after):
    waveform = lobes(peaks=(8000.0,) * 30)
    whole = play(open_rig(), waveform).counts
    rig = open_rig(block_samples=4)
    begin(rig, waveform)
    head = [rig.read().counts for _ in range(stop_after // 4)]
    rig.stop()
    tail = drain(rig)
    counts = np.concatenate([*head, tail.counts], axis=1)
    same = stop_after + 1
    np.testing.assert_array_equal(counts[:, :same], whole[:, :same])
    stops = [event for event in tail.events if event.message.startswith("stopped")]
    assert [event.level for event in stops] == ["info"]


def test_output_is_zero_except_while_running():
    rig = open_rig(block_samples=10)
    assert rig.output == 0.0
    begin(rig, lobes())
    for _ in range(9):
        rig.read()
    assert rig.output == pytest.approx(lobes().window()[90], abs=1.0)
    rig.make_safe()
    assert rig.output == 0.0


def test_events_tell_when_the_laser_loses_the_film_and_finds_it_again():
    settings = RigSettings(laser=LaserSettings(rest_position_mm=39.0, noise_um=0.0))
    rig = open_rig(settings=settings)
    record = play(rig, lobes(peaks=(8000.0,), seconds=2.0))
    assert [event.level for event in record.events] == ["warning", "info"]
    lost, found = record.events
    assert "out of the measuring range" in lost.message
    displacement = record.physical(rig, "displacement")
    inside = displacement[lost.sample + 1 : found.sample - 1]
    assert np.ptp(inside) == 0.0
    assert inside[0] == pytest.approx(0.040, abs=2e-5)


def test_events_tell_when_the_amplifier_lags():
    settings = RigFile.model_validate({"amplifier": {"bandwidth_kHz": 0.2}})
    rig = open_rig(settings=settings)
    record = play(rig, lobes(peaks=(8000.0,), seconds=0.05))
    assert record.events[0].level == "warning"
    assert "amplifier: the output lags" in record.events[0].message


def test_a_film_that_runs_away_is_a_fault_and_stays_where_it_was():
    thin = Film(length=0.075, width=0.072, thickness=0.0001)
    endless = Network.gent((4.6e4, 4.0e4), (math.inf, math.inf), (0.4,))  # no locking stretch
    rig = open_rig(actuator=Actuator(thin, Load(mass=0.02), endless))
    record = play(rig, lobes(peaks=(8000.0,), seconds=8.0))
    faults = [event for event in record.events if event.level == "fault"]
    assert len(faults) == 1
    assert "film: pull-in" in faults[0].message
    assert np.ptp(record.physical(rig, "displacement")[faults[0].sample + 2 :]) < 2e-5
    assert record.counts.shape[1] == 8040


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        (2.0e6, "up to 333333 Hz"),
        (5.0e4, r"scanning 3 inputs takes 80 us, a sample at 50000 Hz 20 us"),
    ],
)
def test_rates_that_the_card_cannot_do_are_refused(rate, message):
    waveform = admit(np.zeros(100), rate, LIMITS, foreseen(100))
    with pytest.raises(RigError, match=message):
        open_rig().load(waveform)


def test_a_reader_that_comes_too_late_gets_the_cards_own_error():
    clock = ManualClock()
    settings = RigFile.model_validate(
        {"card": {"ai_buffer_samples": 1000}, "interlocks": {"late_s": 0.25}}
    )
    rig = open_rig(settings=settings, clock=clock)
    begin(rig, lobes(peaks=(8000.0,) * 20))
    rig.read()
    clock.advance(0.9)
    rig.read()
    clock.advance(1.5)
    with pytest.raises(RigError, match="samples waited for their reader") as caught:
        rig.read()
    assert caught.value.code == INPUT_OVERWRITTEN == -200279
    assert rig.state is RigState.SAFE
    assert rig.output == 0.0


class InterruptedClock(ManualClock):
    """A clock on which somebody presses a button while the reader waits."""

    def __init__(self, presses):
        super().__init__()
        self.presses = presses

    def wait(self, until, wake):
        if self.presses:
            self.presses.pop()()
        super().wait(until, wake)


def test_a_waiting_reader_learns_that_the_rig_was_made_safe():
    presses = []
    rig = open_rig(clock=InterruptedClock(presses))
    begin(rig, lobes())
    presses.append(rig.make_safe)
    with pytest.raises(RigStateError, match="read: the rig is safe"):
        rig.read()


def test_a_stop_reaches_a_waiting_reader():
    presses = []
    rig = open_rig(clock=InterruptedClock(presses))
    waveform = lobes(peaks=(8000.0,) * 20)
    begin(rig, waveform)
    rig.read()
    presses.append(rig.stop)
    assert drain(rig).counts.shape[1] < waveform.samples - 1000


def test_paced_rig_takes_its_time_and_gives_the_same_bytes():
    waveform = lobes(peaks=(5000.0,), seconds=0.04, quiet=0.005)
    before = real_time.monotonic()
    paced = play(open_rig(paced=True, block_samples=20), waveform)
    assert real_time.monotonic() - before > 0.03
    np.testing.assert_array_equal(paced.counts, play(open_rig(), waveform).counts)


def test_paced_clock_wakes_up_early_when_asked():
    wake = threading.Event()
    wake.set()
    clock = PacedClock()
    before = clock.now()
    clock.wait(before + 60.0, wake)
    assert clock.now() - before < 1.0


def test_manual_clock_does_not_go_back():
    with pytest.raises(ValueError, match="moves forward"):
        ManualClock().advance(-1.0)


@pytest.mark.parametrize("address", ["sim:", "sim:x", "sim:-1", "daqmx:Dev1", "simulated", ""])
def test_addresses_that_are_no_simulated_rig(address):
    with pytest.raises(AddressError, match="write sim, or sim:SEED"):
        open_rig(address)


def test_an_actuator_goes_with_the_plain_rig_only():
    with pytest.raises(AddressError, match="has its own film"):
        open_rig("sim:3", actuator=Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3))


def test_address_and_seed_are_in_the_identity_and_what_is_hidden_is_not():
    identity = open_rig("sim:7").identify()
    assert (identity.address, identity.seed, identity.simulated) == ("sim:7", 7, True)
    assert "inertia" not in repr(identity)
    assert open_rig().identify().seed is None


def test_block_samples_must_be_positive():
    with pytest.raises(ValueError, match="block_samples = 0"):
        open_rig(block_samples=0)
