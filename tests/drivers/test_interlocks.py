"""Interlocks on made-up samples: each threshold, its debounce, its action and its message."""

import re

import numpy as np
import pytest

from dearig.drivers.interlocks import Interlocks, would_trip
from dearig.drivers.rig import Block
from dearig.drivers.samples import Computed, Repeated
from dearig.drivers.settings import AmplifierSettings, LaserSettings
from tests.tools.interlock_signals import (
    NAMES,
    PEAK,
    QUIET,
    RATE,
    REST,
    Signals,
    breakdown,
    current,
    displacement,
    following,
    laser,
    monitor,
    watch,
)


def test_a_healthy_run_trips_nothing():
    assert Signals().trips() == []


# --- each threshold with its debounce


BROKEN = [
    # what, needed samples in a row, action, in the message
    (monitor, 50, "ramp", r"monitor read 7\.\d\d kV with \d\.\d\d kV commanded: 1\.5 kV"),
    (
        breakdown,
        2,
        "at once",
        r"monitor read 2\.34 kV with 6\.00 kV commanded, less than 40% of it",
    ),
    (current, 2, "at once", r"current monitor read -20\.1\d mA, 20 mA is allowed"),
    (laser, 50, "ramp", r"laser read (40|39\.99) mm, the end of its range of \+-40 mm"),
    (displacement, 5, "ramp", r"stood 25\.1 mm from its rest state, -20 to 25 mm is allowed"),
    (following, 200, "ramp", r"film had moved 0\.\d\d mm where the model predicts \d\.\d\d mm"),
]


@pytest.mark.parametrize(("spoil", "needed", "action", "words"), BROKEN)
def test_trips_at_the_sample_at_which_it_was_broken_for_so_long(spoil, needed, action, words):
    start = PEAK - needed // 2
    signals = Signals()
    spoil(signals, slice(start, start + needed))
    trips = [t for t in signals.trips() if t.interlock == spoil.__name__]
    assert [(t.sample, t.action) for t in trips] == [(start + needed - 1, action)]
    assert trips[0].message.startswith(f"at {trips[0].sample / RATE:.4g} s the ")
    assert re.search(words, trips[0].message)


@pytest.mark.parametrize(("spoil", "needed", "action", "words"), BROKEN)
def test_does_not_trip_one_sample_earlier(spoil, needed, action, words):
    start = PEAK - needed // 2
    signals = Signals()
    spoil(signals, slice(start, start + needed - 1))
    spoil(signals, slice(start + needed, start + 2 * needed - 1))  # one good sample between
    assert spoil.__name__ not in signals.tripped()


@pytest.mark.parametrize(("spoil", "needed", "action", "words"), BROKEN)
def test_trips_once_a_run(spoil, needed, action, words):
    signals = Signals(samples=4000)
    for peak in (PEAK, PEAK + 500, PEAK + 1000):
        spoil(signals, slice(peak - 110, peak + 110))
    names = [trip.interlock for trip in signals.trips(cuts=range(7, 4000, 7))]
    assert spoil.__name__ in names
    assert len(set(names)) == len(names)


def test_what_is_just_within_its_bounds_never_trips():
    signals = Signals()
    signals.voltage_monitor += 1490.0
    signals.current_monitor += 0.0199
    signals.displacement[QUIET:] = REST + 0.21 * signals.predicted[QUIET:]
    signals.displacement[PEAK - 100 :] += np.linspace(0.0, 24.7e-3, 2000 - PEAK + 100)
    assert signals.trips() == []
    signals.displacement += 0.0398 - signals.displacement.max()
    assert signals.trips() == []
    collapsed = Signals(monitor_tolerance_kV=5.0)
    collapsed.voltage_monitor *= 0.41
    assert collapsed.trips() == []


def test_a_zero_switches_off_where_it_says_so():
    signals = Signals(breakdown_fraction=0.0, laser_stuck_s=0.0, following_fraction=0.0)
    signals.voltage_monitor[:] = 0.0
    signals.displacement[:] = REST
    assert set(signals.tripped()) == {"monitor"}
    loud = Signals()
    loud.voltage_monitor[:] = 0.0
    loud.displacement[:] = REST
    assert set(loud.tripped()) == {"monitor", "breakdown", "laser-stuck", "following"}


@pytest.mark.parametrize("milliseconds", [9.0, 13.0, 26.0])  # times 0.001 and 1000: a hair more
def test_a_debounce_is_not_a_sample_longer_through_rounding(milliseconds):
    signals = Signals(monitor_debounce_ms=milliseconds)
    monitor(signals, slice(PEAK, PEAK + 100))
    assert signals.tripped() == {"monitor": PEAK + round(milliseconds) - 1}


def test_a_debounce_of_zero_trips_at_the_first_sample():
    signals = Signals(current_debounce_ms=0.0)
    current(signals, PEAK)
    assert signals.tripped() == {"current": PEAK}


def test_actions_come_from_the_settings():
    signals = Signals(current_action="ramp", breakdown_action="ramp", monitor_action="at once")
    current(signals, slice(PEAK, PEAK + 10))
    breakdown(signals, slice(PEAK, PEAK + 10))
    monitor(signals, slice(PEAK + 20, PEAK + 80))
    actions = {trip.interlock: trip.action for trip in signals.trips()}
    assert actions["current"] == actions["breakdown"] == "ramp"
    assert actions["monitor"] == "at once"


def test_of_one_sample_the_stronger_action_comes_first():
    signals = Signals(breakdown_action="ramp")
    breakdown(signals, slice(PEAK, PEAK + 10))
    current(signals, slice(PEAK, PEAK + 10))
    trips = [(t.interlock, t.sample) for t in signals.trips()]
    assert trips == [("current", PEAK + 1), ("breakdown", PEAK + 1)]


# --- the voltage


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_within_a_step_the_monitor_may_be_anywhere_between(share):
    signals = Signals(monitor_tolerance_kV=0.1, monitor_debounce_ms=0.0, breakdown_debounce_ms=0.0)
    steps = np.repeat([0.0, 8000.0, 1000.0, 7000.0, 0.0], 400)
    signals.planned = signals.voltage_command = steps
    before = np.append(0.0, steps[:-1])
    signals.voltage_monitor = before + share * (steps - before)
    assert not {"monitor", "breakdown"} & set(signals.tripped())


@pytest.mark.parametrize("cuts", [(), (PEAK,), (PEAK + 1,)])
def test_an_output_that_stays_up_is_found_when_the_command_goes_down(cuts):
    signals = Signals()
    signals.voltage_command[PEAK:] = 0.0
    # the step itself may take one sample
    assert signals.tripped(cuts=cuts)["monitor"] == PEAK + 50


def test_breakdown_of_a_negative_voltage():
    signals = Signals(breakdown_debounce_ms=0.0, following_fraction=0.0)
    for name in ("planned", "voltage_command", "voltage_monitor"):
        setattr(signals, name, -getattr(signals, name))
    assert signals.trips() == []
    signals.voltage_monitor[PEAK] = -2300.0
    assert signals.tripped() == {"breakdown": PEAK}
    signals.voltage_monitor[PEAK] = 6000.0  # of the wrong sign, it is no more of the command
    assert signals.tripped() == {"breakdown": PEAK}


def test_below_its_voltage_a_breakdown_is_not_judged():
    signals = Signals(breakdown_above_kV=7.0)
    signals.voltage_monitor[:] *= 0.1
    assert "breakdown" not in signals.tripped()


@pytest.mark.parametrize(
    ("flowing", "cause"), [(0.039, "broke down or something arcs"), (0.0, "amplifier tripped")]
)
def test_the_current_tells_a_short_from_an_amplifier_that_gave_up(flowing, cause):
    signals = Signals(current_max_mA=39.5)
    breakdown(signals, slice(PEAK, PEAK + 10))
    signals.current_monitor[PEAK : PEAK + 10] = flowing
    (trip,) = signals.trips()
    assert trip.interlock == "breakdown"
    assert cause in trip.message


def test_a_current_at_the_end_of_the_input_may_be_any_current():
    # the input ends at 40
    signals = Signals(amplifier=AmplifierSettings(current_limit_mA=200.0), current_max_mA=100.0)
    signals.current_monitor[PEAK : PEAK + 10] = 0.2
    assert signals.tripped() == {"current": PEAK + 1}


# --- the laser


def test_a_laser_whose_output_falls_as_the_film_gets_longer():
    signals = Signals(laser=LaserSettings(direction=-1))
    assert signals.trips() == []
    displacement(signals, slice(PEAK, PEAK + 10))
    assert signals.tripped() == {"jump": PEAK, "displacement": PEAK + 4}


@pytest.mark.parametrize("end", [-0.05, 0.05])
def test_an_output_at_either_rail_is_an_alarm(end):
    signals = Signals()
    signals.displacement[PEAK : PEAK + 60] = end
    assert signals.tripped()["laser"] == PEAK + 49


@pytest.mark.parametrize("cuts", [(), range(30, 2000, 30)])
def test_displacement_counts_from_the_mean_of_the_lead_in(cuts):
    signals = Signals()
    signals.displacement += 7e-3
    assert signals.trips() == []
    signals.displacement[PEAK:] += np.linspace(0.0, 18.5e-3, signals.displacement.size - PEAK)
    assert "displacement" not in signals.tripped()
    signals.displacement[PEAK:] += np.linspace(0.0, 8e-3, signals.displacement.size - PEAK)
    trip = next(t for t in signals.trips(cuts=cuts) if t.interlock == "displacement")
    moved = signals.displacement[trip.sample] - 7e-3 - REST
    assert moved == pytest.approx(25e-3, abs=1e-4)


def test_a_run_that_is_driven_at_once_counts_from_its_first_reading():
    signals = Signals()
    for name in ("planned", "predicted", *NAMES):
        setattr(signals, name, getattr(signals, name)[QUIET + 1 :])
    assert signals.trips() == []
    displacement(signals, slice(300, 310))
    assert signals.tripped()["displacement"] == 304


def test_nothing_is_out_of_bounds_before_there_is_a_rest_state():
    signals = Signals(displacement_jump_mm=100.0)
    signals.displacement[: QUIET // 2] -= 24e-3
    signals.displacement[QUIET // 2 : QUIET] += 24e-3  # the same mean
    assert signals.trips() == []


@pytest.mark.parametrize(("rate", "needed"), [(200.0, 100), (1000.0, 500), (5000.0, 2500)])
def test_a_stuck_reading_trips_once_the_command_has_moved(rate, needed):
    signals = Signals(samples=round(3 * rate), rate=rate, following_fraction=0.0)
    signals.voltage_command[:] = 5000.0
    signals.voltage_monitor[:] = 5000.0
    start = round(rate)
    signals.displacement[start:] = signals.displacement[start - 1] + 5e-6
    assert signals.trips() == []
    moved = start + needed + 37
    signals.voltage_command[moved:] += 1100.0
    signals.voltage_monitor[moved:] += 1100.0
    assert signals.tripped() == {"laser-stuck": moved}
    signals.voltage_command[start + 3 : start + 5] = 3800.0  # long before
    signals.voltage_monitor[start + 3 : start + 5] = 3800.0
    assert signals.tripped() == {"laser-stuck": start + needed - 1}


@pytest.mark.parametrize("cut", [2000, 100, 30, 1])
def test_what_the_command_did_before_the_reading_stuck_does_not_count(cut):
    signals = Signals(following_fraction=0.0)
    for voltage in (signals.voltage_command, signals.voltage_monitor):
        voltage[:980] = 3000.0
        voltage[980:] = 5000.0
    signals.displacement[960:1010] = REST  # for a while it does not change, then once more
    signals.displacement[1010:] = REST + 5e-6
    cuts = range(cut, 2000, cut)
    assert signals.trips(cuts=cuts) == []
    for voltage in (signals.voltage_command, signals.voltage_monitor):
        voltage[980:1015] = 3000.0
    assert signals.tripped(cuts=cuts) == {"laser-stuck": 1509}


def test_a_reading_that_changes_by_one_count_now_and_then_is_not_stuck():
    signals = Signals(following_fraction=0.0)
    signals.displacement[:] = REST
    signals.displacement[::490] += 3e-6
    assert signals.trips() == []


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0, 20000.0])
def test_a_jump_trips_at_once_whatever_the_rate(rate):
    allowed = 2e-3 * max(1.0, 1.0 / (4e-3 * rate)) ** 2
    for size, tripped in ((1.05, True), (0.9, False)):
        signals = Signals(samples=round(2 * rate), rate=rate, displacement_max_mm=60.0,
                          displacement_min_mm=-60.0, laser_debounce_ms=1e4)  # fmt: skip
        signals.displacement[:] = 0.0
        at = round(rate)
        signals.displacement[at:] = min(size * allowed, 0.0399)
        found = signals.tripped()
        assert found.get("jump") == (at if tripped and allowed < 0.03 else None)


@pytest.mark.parametrize(
    ("lost", "beyond", "trips"),
    [
        (250, 0.0, {}),
        (350, 0.0, {"laser": PEAK + 299}),
        # it comes back elsewhere: the film has moved, or it is another target
        (250, 5e-3, {"jump": PEAK + 250}),
    ],
)
def test_a_laser_out_of_range_is_tolerated_for_its_grace_time_only(lost, beyond, trips):
    signals = Signals()
    signals.displacement[PEAK + lost :] += beyond
    signals.displacement[PEAK : PEAK + lost] = 0.040
    assert {"laser", "jump", "displacement"} <= signals.tripped().keys()
    for cuts in ((), range(7, signals.planned.size, 113)):
        graced = Interlocks(
            signals.settings, signals.channels, RATE, signals.predicted, signals.planned,
            laser_grace=0.3,
        )  # fmt: skip
        found = watch(graced, signals.counts(), cuts)
        assert {trip.interlock: trip.sample for trip in found} == trips


def test_differences_from_one_end_of_a_converter_to_the_other_are_seen():
    signals = Signals(laser_stuck_swing_kV=15.0, displacement_min_mm=-100.0)
    signals.displacement[:] = -0.0399
    signals.displacement[PEAK:] = 0.0399
    for voltage in (signals.voltage_command, signals.voltage_monitor):
        voltage[PEAK:] = -9500.0
        voltage[PEAK + 600 :] = 9500.0
    assert {"jump": PEAK, "laser-stuck": PEAK + 600}.items() <= signals.tripped().items()
    signals.planned = -signals.voltage_command
    signals.predicted[:] = 1.0
    assert "following" not in signals.tripped()


@pytest.mark.parametrize("cuts", [(), range(1, 2000), range(3, 2000, 3)])
def test_a_film_that_swings_fast_does_not_jump(cuts):
    signals = Signals(following_fraction=0.0)
    time = np.arange(2000) / RATE
    swing = 19e-3 * np.minimum(1.0, time / 0.3)
    signals.displacement = REST + swing * np.sin(2.0 * np.pi * 15.0 * time)  # 1.8 m/s
    assert signals.trips(cuts=cuts) == []


# --- whether the film follows


def test_following_is_not_judged_once_the_command_has_left_the_plan():
    signals = Signals()
    ramp = np.linspace(signals.planned[PEAK], 0.0, 200)
    ended = np.append(ramp, np.zeros(1000))
    for name in ("voltage_command", "voltage_monitor"):
        getattr(signals, name)[PEAK : PEAK + 1200] = ended
    signals.displacement[PEAK : PEAK + 1200] = REST + 3e-11 * ended**2
    noise = np.random.default_rng(1).standard_normal(1200)
    signals.displacement[PEAK : PEAK + 1200] += 1e-6 * noise
    assert signals.trips() == []
    assert set(signals.tripped(plan=False)) == {"following"}


@pytest.mark.parametrize("cuts", [(), range(50, 2000, 50)])
def test_a_command_that_left_its_plan_once_is_not_taken_for_it_again(cuts):
    signals = Signals()
    signals.displacement[PEAK:] = REST + 1e-6 * np.random.default_rng(0).standard_normal(1650)
    assert "following" in signals.tripped(cuts=cuts)
    signals.voltage_command[PEAK + 10] += 5.0
    assert signals.trips(cuts=cuts) == []


def test_an_open_electrode_is_found_under_a_drive_that_returns_to_zero_often():
    signals = Signals()
    time = np.maximum(0.0, np.arange(2000) / RATE - QUIET / RATE)
    signals.predicted = 1e-3 * np.sin(5.0 * np.pi * time) ** 2
    signals.displacement += signals.predicted - 3e-11 * signals.planned**2
    assert signals.trips() == []
    signals.displacement[500:] = REST + 1e-6 * np.random.default_rng(0).standard_normal(1500)
    judged = np.flatnonzero(signals.predicted > 0.3e-3)
    assert signals.tripped() == {"following": judged[judged >= 500][199]}


def test_following_is_not_judged_without_a_prediction():
    signals = Signals()
    signals.displacement[:] = REST + 1e-6 * np.random.default_rng(0).standard_normal(2000)
    assert "following" in signals.tripped()
    signals.predicted[PEAK - 100 :] = np.nan
    assert signals.trips() == []
    interlocks = Interlocks(signals.settings, signals.channels, RATE, None, signals.planned)
    assert watch(interlocks, signals.counts()) == []


@pytest.mark.parametrize("cuts", [(), range(7, 2000, 7)])
def test_a_plan_that_is_computed_window_by_window_is_judged_as_one_that_is_held(cuts):
    signals = Signals()
    signals.displacement[PEAK:] = REST + 1e-6 * np.random.default_rng(0).standard_normal(1650)
    expected = signals.trips(cuts=cuts)
    assert expected
    planned = Computed(2000, lambda start, stop: signals.planned[start:stop])
    predicted = Repeated(signals.predicted, 1, 2000)
    computed = Interlocks(signals.settings, signals.channels, RATE, predicted, planned)
    assert watch(computed, signals.counts(), cuts) == expected


def test_a_film_that_should_get_shorter_follows_downwards():
    signals = Signals()
    signals.displacement = 2 * REST - signals.displacement
    assert set(signals.tripped()) == {"following"}
    signals.predicted = -signals.predicted
    assert signals.trips() == []


def test_a_prediction_goes_with_its_plan():
    signals = Signals()
    with pytest.raises(ValueError, match="1999 predicted displacements for 2000 planned voltages"):
        Interlocks(signals.settings, signals.channels, RATE, signals.predicted[1:], signals.planned)


# --- late reader and full disk


def test_a_late_program_and_a_full_disk_trip_once():
    interlocks = Signals(late_action="at once").interlocks()
    assert interlocks.late(0.99) is None
    assert interlocks.disk(100_000_000) is None
    late, disk = interlocks.late(1.25), interlocks.disk(99_000_000)
    assert (late.interlock, late.sample, late.action) == ("late", 0, "at once")
    assert re.search(r"waited 1\.25 s for the program, 1 s is allowed", late.message)
    assert (disk.interlock, disk.sample, disk.action) == ("disk", 0, "ramp")
    assert re.search("disk had 99 MB left, 100 MB must stay free", disk.message)
    assert interlocks.late(9.0) is None
    assert interlocks.disk(0) is None


def test_late_and_disk_know_how_far_the_run_is():
    signals = Signals()
    interlocks = signals.interlocks()
    interlocks.watch(Block(0, signals.counts()[:, :1500]))
    assert interlocks.late(2.0).sample == 1500
    assert interlocks.disk(0).message.startswith("at 1.5 s the disk")


# --- which interlocks a planned run would trip


def planned_trips(s: Signals, displacement: np.ndarray) -> tuple[str, ...]:
    return would_trip(s.settings, s.rate, s.planned, displacement, s.predicted)


def test_a_run_as_predicted_would_trip_nothing():
    s = Signals()
    assert planned_trips(s, s.predicted) == ()
    # nor with a laser that counts the other way, or a film without a prediction
    s = Signals(laser=LaserSettings(direction=-1))
    assert would_trip(s.settings, s.rate, s.planned, s.predicted) == ()


@pytest.mark.parametrize(
    ("part", "locks", "tripped"),
    [
        (1.0, {"displacement_max_mm": 1.0}, ("displacement",)),
        (0.9, {"displacement_max_mm": 1.0}, ()),
        (0.1, {}, ("following",)),
        (0.1, {"following_fraction": 0.05}, ()),
        (40.0, {"displacement_max_mm": 50.0}, ("laser",)),
    ],
)
def test_a_film_that_moves_otherwise_would_trip(part, locks, tripped):
    s = Signals(**locks)
    assert planned_trips(s, part * s.predicted) == tripped
    # as in the run itself
    s.displacement = part * s.predicted + 1e-6 * np.random.default_rng(1).standard_normal(2000)
    assert tuple(s.tripped()) == tripped


def test_a_step_of_the_film_would_trip():
    s = Signals(displacement_jump_mm=0.5)
    jumps = s.predicted + 1e-3 * (np.arange(2000) > 1000)
    assert planned_trips(s, jumps) == ("jump",)


def test_a_film_that_is_planned_to_rest_is_no_stuck_laser():
    s = Signals(laser_stuck_s=0.1, following_fraction=0.0)
    assert planned_trips(s, np.zeros(2000)) == ()
    s.displacement = np.full(2000, REST)
    assert "laser-stuck" in s.tripped()
