"""Faults on purpose in the simulated rig: what each looks like, and which interlock it trips."""

import math
from functools import cache

import numpy as np
import pytest

from dearig.acquisition.plan import Plan, plan
from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.drivers.contract.rig import Record, begin, drain, lobes
from dearig.drivers.errors import RigError, RigStateError
from dearig.drivers.interlocks import Interlocks
from dearig.drivers.rig import RigState
from dearig.sim_backend.card import INPUT_OVERWRITTEN
from dearig.sim_backend.clock import ManualClock
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.faults import Fault, FaultKind, FaultPlan
from dearig.sim_backend.rig import OUTPUT_STARVED
from dearig.sim_backend.signal_path import CHUNK
from tests.deep import mostly_deep

RATE = 1000.0
SIGNAL_FAULTS = (
    FaultKind.ARC,
    FaultKind.FILM_RUPTURE,
    FaultKind.ELECTRODE_OPEN,
    FaultKind.AMPLIFIER_TRIP,
    FaultKind.MONITOR_WIRE_OFF,
    FaultKind.SENSOR_STUCK,
    FaultKind.SENSOR_OUT_OF_RANGE,
    FaultKind.SENSOR_NOISE_BURST,
)


@cache
def rig_file(rate=RATE) -> RigFile:
    return RigFile.model_validate({"card": {"sample_rate_Hz": rate}})


@cache
def planned(preset="thesis", rate=RATE) -> Plan:
    return plan(load_sequence(preset), rig_file(rate))


def open_rig(*faults, address="sim", rate=RATE, **options):
    settings = rig_file(rate)
    return open_simulated_rig(
        address,
        settings,
        settings.as_film(),
        settings.as_load(),
        faults=FaultPlan.parse(faults),
        **options,
    )


@cache
def run(*faults, preset="thesis", rate=RATE, seconds=math.inf, **options):
    """One run, its physical channels by name, and what trips.

    Nothing of it may be changed: tests that ask for the same run share it. ``seconds`` ends it
    early. Blocks are of half a second: five times fewer than by default, and nothing depends on it.
    """
    rig = open_rig(*faults, rate=rate, **{"block_samples": round(0.5 * rate), **options})
    foreseen = planned(preset, rate)
    actual = rig.load(foreseen.admitted())
    rig.arm()
    rig.start()
    channels = rig.identify().channels
    interlocks = Interlocks(
        rig_file(rate), channels, actual, foreseen.displacement_of_samples, foreseen.voltage
    )
    blocks, trips = [], []
    while (block := rig.read()) is not None and block.start < seconds * actual:
        blocks.append(block)
        trips += interlocks.watch(block)
    counts = np.concatenate([block.counts for block in blocks], axis=1)
    record = Record(counts, tuple(blocks), tuple(e for block in blocks for e in block.events))
    physical = {c.name: c.scaling.physical(row) for c, row in zip(channels, counts, strict=True)}
    return record, physical, trips


# --- the plan


def test_a_plan_is_read_from_words_and_put_in_order():
    faults = FaultPlan.parse(["late-reply@2+0.8", "arc@1.5", " film-rupture@3 "])
    assert faults.faults == (
        Fault(FaultKind.ARC, 1.5, 0.01),
        Fault(FaultKind.LATE_REPLY, 2.0, 0.8),
        Fault(FaultKind.FILM_RUPTURE, 3.0),
    )
    assert faults.of(FaultKind.ARC) == faults.faults[:1]
    assert faults.faults[1].end == pytest.approx(2.8)
    assert faults.faults[2].end == math.inf


@pytest.mark.parametrize("item", ["", "arc", "arc@", "arc@-1", "spark@1", "arc@1+", "arc@1e3"])
def test_what_is_no_fault_is_named(item):
    with pytest.raises(ValueError, match=r"not understood: write KIND@SECONDS"):
        FaultPlan.parse([item])


@pytest.mark.parametrize("kind", ["film-rupture", "amplifier-trip"])
def test_what_does_not_heal_has_no_duration(kind):
    with pytest.raises(ValueError, match=f"fault {kind} is permanent"):
        FaultPlan.parse([f"{kind}@1+2"])


@pytest.mark.parametrize(
    ("at", "duration"),
    [(-1.0, 1.0), (math.nan, 1.0), (math.inf, 1.0), (1.0, -1.0), (1.0, math.nan)],
)
def test_times_that_are_none_are_refused(at, duration):
    with pytest.raises(ValueError, match=r"fault arc at .* write times from 0 up"):
        Fault(FaultKind.ARC, at, duration)


def test_a_fault_covers_the_samples_from_its_beginning_to_before_its_end():
    faults = FaultPlan.parse(["arc@0.3+0.003", "amplifier-trip@0.4"])
    arc, trip = (np.flatnonzero(faults.active(0, 500, 1000.0, f.kind)) for f in faults.faults)
    np.testing.assert_array_equal(arc, [300, 301, 302])
    np.testing.assert_array_equal(trip, np.arange(400, 500))
    late = faults.active(301, 100, 1000.0, FaultKind.ARC, FaultKind.AMPLIFIER_TRIP)
    np.testing.assert_array_equal(np.flatnonzero(late), [0, 1, 99])


@pytest.mark.parametrize("kind", ["server-frozen", "server-gone", "serial-garbage"])
def test_a_rig_without_a_server_refuses_its_faults(kind):
    with pytest.raises(ValueError, match=f"fault {kind} needs a server or a serial port"):
        open_rig(f"{kind}@1")


# --- what each fault looks like

AT, SAMPLE = 4.0, 4000  # on the rise of a lobe; the first chunk ends at sample 4096


def test_arc_collapses_the_output_at_the_current_limit_and_lets_go():
    _, healthy, _ = run()
    _, seen, _ = run(f"arc@{AT}+0.2")
    during = slice(SAMPLE, SAMPLE + 200)
    assert healthy["voltage_monitor"][during].min() > 1000.0
    assert np.abs(seen["voltage_monitor"][during]).max() < 10.0
    assert seen["current_monitor"][during] == pytest.approx(0.04, rel=2e-3)
    after = slice(SAMPLE + 201, None)  # 60 us after the arc the output is still on its way up
    np.testing.assert_allclose(
        seen["voltage_monitor"][after], healthy["voltage_monitor"][after], atol=1.0
    )
    assert np.abs(seen["current_monitor"][after]).max() < 1e-4
    dip = healthy["displacement"] - seen["displacement"]
    assert dip[SAMPLE : SAMPLE + 300].max() > 5e-5
    assert dip[-500:].max() < 1e-5


@pytest.mark.parametrize("at", [AT, 4.07])  # the second falls on over the end of a chunk
def test_a_ruptured_film_is_a_short_and_drops_its_load(at):
    record, seen, _ = run(f"film-rupture@{at}")
    sample = round(at * RATE)
    assert np.abs(seen["voltage_monitor"][sample:]).max() < 10.0
    driven = seen["voltage_command"] > 100.0
    driven[:sample] = False
    assert seen["current_monitor"][driven] == pytest.approx(0.04, rel=2e-3)
    still = np.abs(seen["voltage_command"]) < 1.0
    assert np.abs(seen["current_monitor"][still]).max() < 1e-4
    fallen = seen["displacement"][sample : sample + 60] - seen["displacement"][sample]
    elapsed = np.arange(60) / RATE
    speed = np.polyfit(elapsed, fallen - 0.5 * 9.81 * elapsed**2, 1)
    np.testing.assert_allclose(
        fallen - 0.5 * 9.81 * elapsed**2, np.polyval(speed, elapsed), atol=2e-5
    )
    assert abs(speed[0]) < 0.02  # the film's own, before
    assert seen["displacement"][-1] == pytest.approx(0.04, abs=2e-5)  # out of the laser's range
    assert any("out of the measuring range" in event.message for event in record.events)


def test_an_open_electrode_lets_the_film_relax_and_nothing_flows():
    _, healthy, _ = run()
    _, seen, _ = run(f"electrode-open@{AT}")
    np.testing.assert_allclose(seen["voltage_monitor"], healthy["voltage_monitor"], atol=1.0)
    rest = healthy["displacement"][:1000].mean()
    assert healthy["displacement"][-15000:].max() - rest > 1e-3
    assert np.abs(seen["displacement"][-15000:] - rest).max() < 5e-5
    assert seen["current_monitor"][SAMPLE:].std() == pytest.approx(4e-6, rel=0.1)  # 1 mV of noise


def test_a_tripped_amplifier_gives_nothing_for_good():
    _, seen, _ = run(f"amplifier-trip@{AT}")
    assert np.abs(seen["voltage_monitor"][SAMPLE:]).max() < 10.0
    assert np.abs(seen["current_monitor"][SAMPLE:]).max() < 1e-4
    rest = seen["displacement"][:1000].mean()
    assert np.abs(seen["displacement"][-15000:] - rest).max() < 5e-5


def test_a_monitor_wire_that_is_off_changes_nothing_else():
    healthy, _, _ = run()
    record, seen, _ = run(f"monitor-wire-off@{AT}")
    assert 0.1 < seen["voltage_monitor"][SAMPLE:].std() < 5.0
    others = [0, 2, 3]
    np.testing.assert_array_equal(record.counts[others], healthy.counts[others])


def test_a_stuck_sensor_keeps_its_count_while_the_film_goes_on():
    healthy, _, _ = run()
    record, _, _ = run(f"sensor-stuck@{AT}+2")
    expected = healthy.counts.copy()
    expected[3, SAMPLE : SAMPLE + 2000] = healthy.counts[3, SAMPLE]
    np.testing.assert_array_equal(record.counts, expected)


def test_a_sensor_out_of_range_puts_its_output_at_the_rail():
    record, seen, _ = run(f"sensor-out-of-range@{AT}+1")
    assert seen["displacement"][SAMPLE : SAMPLE + 1000] == pytest.approx(0.04, abs=2e-5)
    assert seen["displacement"][SAMPLE + 1001] < 0.01
    assert [event.sample for event in record.events] == [SAMPLE, SAMPLE + 1000]


def test_a_noise_burst_is_several_millimetres_for_its_time():
    healthy, _, _ = run()
    record, seen, _ = run(f"sensor-noise-burst@{AT}")
    burst = slice(SAMPLE, SAMPLE + 200)
    assert 0.003 < seen["displacement"][burst].std() < 0.005
    counts = record.counts.copy()
    counts[3, burst] = healthy.counts[3, burst]
    np.testing.assert_array_equal(counts, healthy.counts)


@pytest.mark.parametrize("kind", SIGNAL_FAULTS)
def test_a_fault_leaves_what_came_before_as_it_is(kind):
    healthy, _, _ = run()
    record, _, _ = run(f"{kind}@{AT}", seconds=AT + 2.0)
    np.testing.assert_array_equal(record.counts[:, :SAMPLE], healthy.counts[:, :SAMPLE])
    end = record.counts.shape[1]
    assert not np.array_equal(record.counts, healthy.counts[:, :end])


@pytest.mark.parametrize(
    "kind",
    mostly_deep(SIGNAL_FAULTS, [FaultKind.ARC]),
)
def test_blocks_chunks_and_a_second_rig_change_nothing(kind):
    # over the border between two chunks
    fault = f"{kind}@{(CHUNK - 5) / RATE}"
    whole, _, _ = run(fault)
    size = CHUNK + 1000  # samples until well after the fault
    events = [event for event in whole.events if event.sample < size]
    assert events
    for block_samples in (7, 333, 10**6):
        record, _, _ = run(fault, block_samples=block_samples, seconds=size / RATE)
        np.testing.assert_array_equal(record.counts[:, :size], whole.counts[:, :size])
        assert [event for event in record.events if event.sample < size] == events


@pytest.mark.parametrize("kind", SIGNAL_FAULTS)
@pytest.mark.parametrize("stopped", [CHUNK - 100, CHUNK, CHUNK + 100])
def test_a_stop_after_a_fault_ramps_down_from_what_there_is(kind, stopped):
    fault = f"{kind}@{(CHUNK - 200) / RATE}"
    whole, _, _ = run(fault)
    rig = open_rig(fault, block_samples=stopped // 4)
    begin(rig, planned().admitted())
    head = [rig.read().counts for _ in range(4)]
    rig.stop()
    tail = drain(rig)
    counts = np.concatenate([*head, tail.counts], axis=1)
    np.testing.assert_array_equal(counts[:, : stopped + 1], whole.counts[:, : stopped + 1])
    assert abs(int(counts[0, -1])) <= 1


def test_every_run_has_its_faults_again():
    rig = open_rig("arc@0.1")
    for _ in range(2):
        begin(rig, lobes())
        record = drain(rig)
        assert np.abs(record.physical(rig, "voltage_monitor")[100:110]).max() < 10.0


# --- the card's faults


@pytest.mark.parametrize(
    ("kind", "code", "words"),
    [
        ("ai-overflow", INPUT_OVERWRITTEN, "overwritten before they were read"),
        ("ao-underflow", OUTPUT_STARVED, "ran out of written samples"),
    ],
)
def test_errors_of_the_card_come_at_their_time_with_the_output_at_zero(kind, code, words):
    clock = ManualClock()
    rig = open_rig(f"{kind}@4.321", clock=clock)
    begin(rig, planned().admitted())
    blocks = [rig.read() for _ in range(43)]
    with pytest.raises(RigError, match=words) as caught:
        rig.read()
    assert caught.value.code == code
    assert clock.now() == pytest.approx(4.321)
    assert blocks[-1].start + blocks[-1].counts.shape[1] == 4300
    assert rig.state is RigState.SAFE
    assert rig.output == 0.0


def test_a_late_reply_keeps_the_reader_waiting_once_and_loses_nothing():
    clock = ManualClock()
    rig = open_rig("late-reply@4.03+0.8", clock=clock)
    begin(rig, planned().admitted())
    times, starts, waiting = [], [], []
    while (block := rig.read()) is not None:
        times.append(clock.now())
        starts.append(block.start)
        waiting.append(rig.waiting)
    steps = np.diff(times)
    late = int(np.argmax(steps))
    assert starts[late + 1] == 4000
    assert times[late + 1] == pytest.approx(4.83)
    assert waiting[late + 1] == pytest.approx(0.73, abs=1e-6)
    assert np.delete(steps, late).max() < 0.11
    assert max(waiting[late + 10 :]) < 0.01  # it has caught up
    assert starts == list(range(0, 100 * len(starts), 100))


def test_a_late_reply_that_is_too_late_for_the_buffer_loses_samples():
    settings = RigFile.model_validate(
        {"card": {"ai_buffer_samples": 1000}, "interlocks": {"late_s": 0.25}}
    )
    rig = open_simulated_rig(
        "sim", settings, settings.as_film(), settings.as_load(),
        faults=FaultPlan.parse(["late-reply@1+3"]),
    )  # fmt: skip
    begin(rig, planned().admitted())
    with pytest.raises(RigError, match="3100 samples waited") as caught:
        drain(rig)
    assert caught.value.code == INPUT_OVERWRITTEN


class MadeSafeWhileWaiting(ManualClock):
    """A clock on which the rig is made safe during the third wait."""

    def __init__(self):
        super().__init__()
        self.waits = 0
        self.rig = None

    def wait(self, until, wake):
        self.waits += 1
        if self.waits == 3:
            self.rig.make_safe()
        super().wait(until, wake)


def test_a_late_reply_does_not_hold_up_the_way_to_safety():
    clock = MadeSafeWhileWaiting()
    clock.rig = open_rig("late-reply@0.15+1000", clock=clock)
    begin(clock.rig, planned().admitted())
    clock.rig.read()
    with pytest.raises(RigStateError, match="read: the rig is safe"):
        clock.rig.read()
    assert clock.now() < 1.0


@pytest.mark.parametrize(
    ("fault", "sizes"),
    [
        ("short-read@4.0", [100, 1, 100, 100, 100, 100]),
        ("short-read@4.03", [100, 31, 100, 100, 100, 100]),
        ("short-read@4.099", [100, 99, 1, 100, 100, 100]),
        ("short-read@4.03+0.1", [100, 31, 50, 50, 100, 100]),
    ],
)
def test_a_short_read_is_a_smaller_block_and_loses_nothing(fault, sizes):
    whole, _, _ = run()
    record, _, _ = run(fault, block_samples=100)
    assert [block.counts.shape[1] for block in record.blocks[39:45]] == sizes
    np.testing.assert_array_equal(record.counts, whole.counts)


# --- which interlock trips, and when

ONCE, RAMP = "at once", "ramp"

#: fault -> the first interlock that trips, its action, and within how many ms it does so, at a
#: moment when the film is driven (a slow peak, where nothing moves for a second, is one of them)
EXPECTED = {
    FaultKind.ARC: ("breakdown", ONCE, 2.0),
    FaultKind.FILM_RUPTURE: ("breakdown", ONCE, 2.0),
    FaultKind.ELECTRODE_OPEN: ("following", RAMP, 800.0),
    FaultKind.AMPLIFIER_TRIP: ("breakdown", ONCE, 2.0),
    FaultKind.MONITOR_WIRE_OFF: ("breakdown", ONCE, 2.0),
    FaultKind.SENSOR_STUCK: ("laser-stuck", RAMP, 1400.0),
    FaultKind.SENSOR_OUT_OF_RANGE: ("jump", RAMP, 0.0),
    FaultKind.SENSOR_NOISE_BURST: ("jump", RAMP, 25.0),
}


@pytest.mark.parametrize("rate", [200.0, 1000.0])
@pytest.mark.parametrize("at", [3.2, 4.0955, 7.77, 14.0])
@pytest.mark.parametrize("kind", SIGNAL_FAULTS)
def test_a_fault_trips_its_interlock_in_time(kind, at, rate):
    interlock, action, within = EXPECTED[kind]
    _, _, trips = run(f"{kind}@{at}", rate=rate, seconds=at + 2.0)
    assert trips, "nothing tripped"
    onset = math.ceil(at * rate - 1e-6)
    first = [trip for trip in trips if trip.sample == trips[0].sample]
    assert interlock in {trip.interlock for trip in first}
    assert trips[0].action == action
    assert 0.0 <= (trips[0].sample - onset) / rate <= within * 1e-3 + 1e-9
    assert len({trip.interlock for trip in trips}) == len(trips)
    assert f"at {trips[0].sample / rate:.4g} s" in trips[0].message


def test_a_ruptured_film_trips_what_it_must_without_the_monitors():
    _, _, trips = run(f"film-rupture@{AT}")
    at = {trip.interlock: trip.sample - SAMPLE for trip in trips}
    assert at["current"] == at["breakdown"] == 1
    assert at["displacement"] < 85  # 25 mm of free fall take 71 ms
    assert at["laser"] < 140


@pytest.mark.parametrize("address", ["sim:0", "sim:3", "sim:12"])
@pytest.mark.parametrize("kind", SIGNAL_FAULTS)
def test_faults_are_found_on_rigs_that_hide_something(kind, address):
    interlock, action, within = EXPECTED[kind]
    _, _, trips = run(f"{kind}@3.2", address=address, seconds=5.0)
    assert (trips[0].interlock, trips[0].action) == (interlock, action)
    assert trips[0].sample - 3200 <= within


# friction, an output that lags, a tear, a shaken stand that moves the reading by 15 mm
ADDRESSES = ("sim", "sim:3", "sim:21", "sim:28", "sim:33")
RUNS = [
    pytest.param(address, preset, rate, id=f"{address} {preset} {rate:g}")
    for address in ADDRESSES
    for preset in ("rich", "thesis", "validation-a-1.0", "validation-b-8.0")
    for rate in (1000.0, 200.0)
]


@pytest.mark.parametrize(
    ("address", "preset", "rate"),
    mostly_deep(
        RUNS,
        [f"{a} rich 1000" for a in ADDRESSES] + ["sim:3 thesis 200", "sim validation-b-8.0 200"],
    ),
)
def test_a_run_without_faults_trips_nothing(address, preset, rate):
    record, _, trips = run(address=address, preset=preset, rate=rate)
    assert trips == []
    assert record.counts.shape[1] == planned(preset, rate).samples


def test_every_preset_runs_without_a_trip():
    for preset in PRESETS:
        _, _, trips = run(preset=preset)
        assert trips == [], preset
