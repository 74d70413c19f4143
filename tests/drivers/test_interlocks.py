"""Interlocks on made-up samples: each threshold, its debounce, and that cuts change nothing."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.drivers.interlocks import Interlocks, Trip, would_trip
from dearig.drivers.rig import Block
from dearig.drivers.settings import AmplifierSettings, InterlockSettings, LaserSettings, RigSettings

RATE = 1000.0
QUIET = 100  # samples of lead-in
REST = 6.4e-3  # m, reading of the loaded rest state
NAMES = ("voltage_command", "voltage_monitor", "current_monitor", "displacement")
#: Calibrations of the inputs as a card has them.
COEFFICIENTS = {
    "voltage_command": (0.0, 10.0 / 32768),
    "voltage_monitor": (1e-3, 10.0 / 32768 * 1.0002, 1e-12, -1e-17),
    "current_monitor": (-1e-3, 10.0 / 32768 * 0.9998, 1e-12, 1e-17),
    "displacement": (5e-4, 10.0 / 32768 * 1.0001, -1e-12, 1e-17),
}


class Signals:
    """A healthy run: half-sine lobes of 6 kV and 0.5 s, the film following."""

    def __init__(
        self,
        samples=2000,
        rate=RATE,
        laser: LaserSettings | None = None,
        amplifier: AmplifierSettings | None = None,
        **locks,
    ):
        self.settings = RigSettings(
            interlocks=InterlockSettings(**locks),
            laser=laser or LaserSettings(),
            amplifier=amplifier or AmplifierSettings(),
        )
        self.rate = rate
        self.channels = self.settings.channels(COEFFICIENTS)
        time = np.maximum(0.0, np.arange(samples) / rate - QUIET / RATE)
        self.planned = 6000.0 * np.abs(np.sin(np.pi * time / 0.5))
        self.predicted = 3e-11 * self.planned**2
        self.voltage_command = self.planned.copy()
        self.voltage_monitor = self.planned.copy()
        self.current_monitor = np.zeros(samples)
        noise = np.random.default_rng(0).standard_normal(samples)
        self.displacement = REST + self.predicted + 1e-6 * noise

    def counts(self):
        rows = (c.scaling.counts(getattr(self, c.name)) for c in self.channels)
        return np.stack(list(rows))

    def interlocks(self, plan=True):
        planned = self.planned if plan else None
        return Interlocks(self.settings, self.channels, self.rate, self.predicted, planned)

    def trips(self, cuts=(), plan=True):
        return watch(self.interlocks(plan), self.counts(), cuts)

    def tripped(self, **more):
        return {trip.interlock: trip.sample for trip in self.trips(**more)}


def watch(interlocks: Interlocks, counts: np.ndarray, cuts=()) -> list[Trip]:
    edges = [0, *sorted(cuts), counts.shape[1]]
    trips: list[Trip] = []
    for begin, end in itertools.pairwise(edges):
        trips += interlocks.watch(Block(begin, counts[:, begin:end]))
    return trips


PEAK = QUIET + 250  # 6 kV, and 1.08 mm


def test_a_healthy_run_trips_nothing():
    assert Signals().trips() == []


# --- every threshold with its debounce: what is broken, and for how many samples it may be


def monitor(s, at):
    s.voltage_monitor[at] += 1600.0


def breakdown(s, at):
    s.voltage_monitor[at] *= 0.39


def current(s, at):
    s.current_monitor[at] = -0.0201


def laser(s, at):
    s.displacement[at] = 0.040


def displacement(s, at):
    s.displacement[at] = REST + 25.1e-3


def following(s, at):
    s.displacement[at] = REST + 0.19 * s.predicted[at]


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
    assert_matches(words, trips[0].message)


@pytest.mark.parametrize(("spoil", "needed", "action", "words"), BROKEN)
def test_does_not_trip_one_sample_earlier(spoil, needed, action, words):
    start = PEAK - needed // 2
    signals = Signals()
    spoil(signals, slice(start, start + needed - 1))
    spoil(signals, slice(start + needed, start + 2 * needed - 1))  # one good sample between
    assert spoil.__name__ not in signals.tripped()


def assert_matches(words, message):
    with pytest.raises(RuntimeError, match=words):
        raise RuntimeError(message)


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


def test_an_open_electrode_is_found_under_a_drive_that_comes_back_to_zero_all_the_time():
    signals = Signals()
    time = np.maximum(0.0, np.arange(2000) / RATE - QUIET / RATE)
    signals.predicted = 1e-3 * np.sin(5.0 * np.pi * time) ** 2
    signals.displacement += signals.predicted - 3e-11 * signals.planned**2
    assert signals.trips() == []
    signals.displacement[500:] = REST + 1e-6 * np.random.default_rng(0).standard_normal(1500)
    judged = np.flatnonzero(signals.predicted > 0.3e-3)
    assert signals.tripped() == {"following": judged[judged >= 500][199]}


def test_following_is_not_judged_where_nothing_is_foreseen():
    signals = Signals()
    signals.displacement[:] = REST + 1e-6 * np.random.default_rng(0).standard_normal(2000)
    assert "following" in signals.tripped()
    signals.predicted[PEAK - 100 :] = np.nan
    assert signals.trips() == []
    interlocks = Interlocks(signals.settings, signals.channels, RATE, None, signals.planned)
    assert watch(interlocks, signals.counts()) == []


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


# --- what is not in the samples


def test_a_late_program_and_a_full_disk_trip_once():
    interlocks = Signals(late_action="at once").interlocks()
    assert interlocks.late(0.99) is None
    assert interlocks.disk(100_000_000) is None
    late, disk = interlocks.late(1.25), interlocks.disk(99_000_000)
    assert (late.interlock, late.sample, late.action) == ("late", 0, "at once")
    assert_matches(r"waited 1\.25 s for the program, 1 s is allowed", late.message)
    assert (disk.interlock, disk.sample, disk.action) == ("disk", 0, "ramp")
    assert_matches("disk had 99 MB left, 100 MB must stay free", disk.message)
    assert interlocks.late(9.0) is None
    assert interlocks.disk(0) is None


def test_late_and_disk_know_how_far_the_run_is():
    signals = Signals()
    interlocks = signals.interlocks()
    interlocks.watch(Block(0, signals.counts()[:, :1500]))
    assert interlocks.late(2.0).sample == 1500
    assert interlocks.disk(0).message.startswith("at 1.5 s the disk")


# --- blocks


def test_blocks_must_follow_each_other():
    counts = Signals().counts()
    interlocks = Signals().interlocks()
    interlocks.watch(Block(0, counts[:, :10]))
    with pytest.raises(ValueError, match="begins with sample 20, but sample 10 is next"):
        interlocks.watch(Block(20, counts[:, 20:30]))


def test_an_empty_block_is_nothing():
    signals = Signals()
    interlocks = signals.interlocks()
    assert interlocks.watch(Block(0, signals.counts()[:, :0])) == []
    assert watch(interlocks, signals.counts()) == []


SPOILT = st.tuples(
    st.sampled_from([
        monitor, breakdown, current, laser, displacement, following,
        "still", "jump", "stopped", "noise",
    ]),
    st.integers(0, 599),
    st.integers(1, 300),
)  # fmt: skip


def spoilt(faults, **locks) -> Signals:
    signals = Signals(600, monitor_debounce_ms=20.0, following_debounce_ms=30.0,
                      laser_stuck_s=0.05, laser_debounce_ms=20.0, **locks)  # fmt: skip
    for what, start, length in faults:
        at = slice(start, start + length)
        if what == "still":
            signals.displacement[at] = signals.displacement[start]
        elif what == "jump":
            signals.displacement[at] += 2.1e-3
        elif what == "noise":
            signals.displacement[at] += 3e-3 * np.cos(7.0 * np.arange(600)[at] ** 2)
        elif what == "stopped":
            signals.voltage_command[start:] = 0.0
        else:
            what(signals, at)
    return signals


@settings(max_examples=60)
@given(
    faults=st.lists(SPOILT, max_size=5),
    cuts=st.sets(st.integers(1, 599), max_size=40),
    plan=st.booleans(),
)
def test_where_blocks_are_cut_changes_nothing(faults, cuts, plan):
    signals = spoilt(faults)
    whole = signals.trips(plan=plan)
    assert signals.trips(cuts=cuts, plan=plan) == whole
    assert signals.trips(cuts=range(1, 600), plan=plan) == whole


THRESHOLDS = ("monitor", "breakdown", "current", "laser", "displacement")


def slowly(signals: Signals) -> dict[str, int]:
    """The same, sample by sample and in plain numbers, of those that are a threshold in a row."""
    locks, rate = signals.settings.interlocks, signals.rate
    physical = {
        c.name: c.scaling.physical(row).tolist()
        for c, row in zip(signals.channels, signals.counts(), strict=True)
    }
    command, shown = physical["voltage_command"], physical["voltage_monitor"]
    reading = physical["displacement"]
    quiet = next((i for i, v in enumerate(command) if v != 0.0), None)
    rest = sum(reading[:quiet]) / quiet if quiet else reading[0]
    in_a_row = dict.fromkeys(THRESHOLDS, 0)
    needed = {name: getattr(locks, f"{name}_debounce_ms") for name in THRESHOLDS}
    found: dict[str, int] = {}
    for i, now in enumerate(command):
        last = command[i - 1] if i else 0.0
        low, high, least = min(now, last), max(now, last), min(abs(now), abs(last))
        moved = (reading[i] - rest) * 1e3
        broken = {
            "monitor": not low - 1500.0 <= shown[i] <= high + 1500.0,
            "breakdown": least > 500.0 and shown[i] < 0.4 * least,
            "current": abs(physical["current_monitor"][i]) >= 0.02,
            "laser": abs(reading[i]) >= 0.03996,
            "displacement": quiet is not None and i >= quiet and not -20.0 <= moved <= 25.0,
        }
        for name, is_broken in broken.items():
            in_a_row[name] = in_a_row[name] + 1 if is_broken else 0
            if in_a_row[name] * 1e3 / rate >= needed[name] and is_broken:
                found.setdefault(name, i)
    return found


@settings(max_examples=100)
@given(faults=st.lists(SPOILT, min_size=1, max_size=5))
def test_what_trips_is_what_a_slow_look_finds(faults):
    signals = spoilt(faults)
    found = slowly(signals)
    tripped = signals.tripped()
    assert {name: at for name, at in tripped.items() if name in THRESHOLDS} == found


@settings(max_examples=60)
@given(
    counts=st.lists(
        st.tuples(*(st.sampled_from([-32768, -20000, 0, 1, 300, 20000, 32767]) for _ in range(4))),
        min_size=1,
        max_size=120,
    ),
    cuts=st.sets(st.integers(1, 119), max_size=10),
)
def test_no_counts_are_too_wild(counts, cuts):
    wild = np.array(counts, dtype=np.int16).T
    signals = Signals(100)
    whole = watch(signals.interlocks(), wild)
    names = [trip.interlock for trip in whole]
    assert len(set(names)) == len(names)
    assert [t.sample for t in whole] == sorted(t.sample for t in whole)
    assert all(0 <= t.sample < wild.shape[1] and t.message for t in whole)
    assert watch(signals.interlocks(), wild, [c for c in cuts if c < wild.shape[1]]) == whole


def test_a_thermometer_among_the_channels_is_passed_over():
    signals = Signals()
    channels = (*signals.channels, replace(signals.channels[3], name="temperature", unit="K"))
    counts = np.concatenate((signals.counts(), np.full((1, 2000), 32767, dtype=np.int16)))
    interlocks = Interlocks(signals.settings, channels, RATE, signals.predicted, signals.planned)
    assert watch(interlocks, counts) == []


# --- what a run would end by, before it is run


def foreseen(s: Signals, displacement: np.ndarray) -> tuple[str, ...]:
    return would_trip(s.settings, s.rate, s.planned, displacement, s.predicted)


def test_a_run_as_foreseen_would_trip_nothing():
    s = Signals()
    assert foreseen(s, s.predicted) == ()
    # nor with a laser that counts the other way, or a film that nobody foresees
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
    assert foreseen(s, part * s.predicted) == tripped
    # as it does where it is run
    s.displacement = part * s.predicted + 1e-6 * np.random.default_rng(1).standard_normal(2000)
    assert tuple(s.tripped()) == tripped


def test_a_step_of_the_film_would_trip():
    s = Signals(displacement_jump_mm=0.5)
    jumps = s.predicted + 1e-3 * (np.arange(2000) > 1000)
    assert foreseen(s, jumps) == ("jump",)


def test_a_film_that_is_told_to_stand_still_is_no_stuck_laser():
    s = Signals(laser_stuck_s=0.1, following_fraction=0.0)
    assert foreseen(s, np.zeros(2000)) == ()
    s.displacement = np.full(2000, REST)
    assert "laser-stuck" in s.tripped()
