"""Waveforms: eq. 49 to the letter, what joins, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.model.errors import ModelError
from dearig.model.simulation.excitation import (
    THESIS_AMPLITUDES,
    THESIS_FREQUENCIES,
    Chirp,
    HalfSine,
    Hold,
    Lobes,
    Multisine,
    Ramp,
    Sampled,
    Sequence,
    Sine,
    Steps,
    Triangle,
)


def rem(t, period):
    return t - period * math.floor(t / period)


def thesis_v(t, a=THESIS_AMPLITUDES, f=THESIS_FREQUENCIES):
    """Eq. 49, line by line."""
    pi, sin = math.pi, math.sin
    e1 = 1 / f[0]
    e2 = e1 + 1 / f[1]
    e3 = e2 + 1 / f[2]
    e4 = e3 + 1 / f[3]
    e5 = e4 + 1 / f[4]
    tm = rem(t, e5)
    if tm <= e1:
        return a[0] * sin(f[0] * pi * tm)
    if tm <= e2:
        return a[1] * sin(f[1] * pi * tm - f[1] * pi * e1)
    if tm <= e3:
        return a[2] * sin(f[2] * pi * tm - f[2] * pi * e2)
    if tm <= e4:
        return a[3] * sin(f[3] * pi * tm - f[3] * pi * e3)
    return a[4] * sin(f[4] * pi * tm - f[4] * pi * e4)


@pytest.mark.parametrize("rate", [100.0, 1000.0, 333.3])
def test_equation_49(rate):
    lobes = Lobes(periods=2)
    time = np.arange(math.floor(lobes.duration * rate)) / rate
    expected = np.array([thesis_v(t) for t in time])
    np.testing.assert_allclose(lobes.voltage(time), expected, atol=1e-6)
    assert lobes.period == pytest.approx(11.4166667)
    assert lobes.voltage(time).min() >= 0.0


@pytest.mark.parametrize(
    ("amplitudes", "frequencies"),
    [((6e3,) * 5, THESIS_FREQUENCIES), (THESIS_AMPLITUDES, (0.4,) * 5)],
)
def test_the_validation_sets(amplitudes, frequencies):
    time = np.linspace(0.0, 10.0, 1001)
    lobes = Lobes(amplitudes, frequencies, 2)
    expected = np.array([thesis_v(t, amplitudes, frequencies) for t in time])
    np.testing.assert_allclose(lobes.voltage(time), expected, atol=1e-6)


SEGMENTS = [
    HalfSine(5e3, 0.7),
    Lobes(),
    Sine(2e3, 3.0, 2.0, 4e3, -0.5 * math.pi),
    Triangle(6e3, 2.0),
    Ramp(3e3, 0.4, 1e3),
    Hold(1.3, 2e3),
    Steps((1e3, 4e3, 2e3), 0.5, 0.02, 500.0),
    Chirp(2e3, 0.1, 20.0, 5.0, 3e3),
    Chirp(2e3, 0.1, 20.0, 5.0, 3e3, linear=True),
    Multisine(2e3, (0.3, 1.1, 4.7), 6.0, 2.5e3),
    Sampled(np.array([1.0, 1.5, 3.0]), np.array([0.0, 5e3, 1e3])),
]


@pytest.mark.parametrize("segment", SEGMENTS, ids=lambda s: type(s).__name__)
def test_a_segment_starts_and_ends_where_it_says(segment):
    at = np.array([0.0, segment.duration])
    np.testing.assert_allclose(segment.voltage(at), [segment.start, segment.end], atol=1e-6)
    inside = segment.voltage(np.linspace(0.0, segment.duration, 5001))
    assert np.isfinite(inside).all()
    # continuous: no jump between neighbours beyond what its steepest part can do
    assert np.abs(np.diff(inside)).max() < 0.1 * max(np.ptp(inside), 1.0)


@pytest.mark.parametrize("segment", SEGMENTS, ids=lambda s: type(s).__name__)
def test_a_segment_after_another(segment):
    assert segment.after(700.0).start in (segment.start, 700.0)


@pytest.mark.parametrize(
    "segment",
    [
        Ramp(3e3, 0.4),
        Hold(1.0),
        Steps((1e3,), 0.5),
        Chirp(1e2, 1.0, 2.0, 1.0),
        Multisine(1e2, (1.0,), 2.0),
    ],
    ids=lambda s: type(s).__name__,
)
def test_an_open_start_is_where_the_one_before_ended(segment):
    sequence = Sequence("x", (Ramp(2e3, 0.5), segment, Ramp(0.0, 0.5)))
    assert sequence.segments[1].start == 2e3
    _, voltage = sequence.sample(1000.0)
    assert np.abs(np.diff(voltage)).max() < 110.0


def test_multisine_reaches_its_amplitude_and_no_further():
    segment = Multisine(2e3, (0.3, 1.1, 4.7), 6.0, 2.5e3)
    swing = np.abs(segment.voltage(np.linspace(0.0, 6.0, 40001)) - 2.5e3)
    assert swing.max() == pytest.approx(2e3, rel=1e-4)
    assert swing.max() <= 2e3


def test_chirp_frequencies():
    segment = Chirp(1.0, 1.0, 8.0, 6.0, 0.0)
    time = np.linspace(0.0, 6.0, 600001)
    v = segment.voltage(time)
    up = time[:-1][(v[:-1] < 0.0) & (v[1:] >= 0.0)]
    middle, frequency = 0.5 * (up[1:] + up[:-1]), 1.0 / np.diff(up)
    # three octaves in 6 s
    np.testing.assert_allclose(frequency, 2.0 ** (0.5 * middle), rtol=0.03)


@pytest.mark.parametrize(
    ("segments", "message"),
    [
        ((), "the sequence has no segment"),
        (
            (Ramp(2e3, 1.0), HalfSine(5e3, 1.0)),
            "segment 2 starts at 0 kV but segment 1 ends at 2 kV: put a ramp",
        ),
        ((Sine(1e3, 1.0, offset=2e3),), "segment 1 starts at 2 kV but the lead-in ends at 0 kV"),
        ((Ramp(2e3, 1.0),), "segment 1 ends at 2 kV but the run ends at 0 kV: put a ramp to 0"),
    ],
)
def test_what_does_not_join(segments, message):
    with pytest.raises(ModelError, match=message):
        Sequence("x", segments)


def test_labels_name_the_segment():
    with pytest.raises(ModelError, match=r"segment 2 \(steps\) ends at 3 kV"):
        Sequence("x", (Ramp(1e3, 1.0), Steps((3e3,), 1.0)), labels=("ramp", "steps"))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: HalfSine(5e3, 0.0), "half_sine: frequency = 0.0 must be above 0"),
        (lambda: HalfSine(math.nan, 1.0), "half_sine: amplitude = nan must be a finite number"),
        (lambda: Lobes((1.0,), (1.0, 2.0)), "1 amplitudes and 2 frequencies"),
        (lambda: Lobes(periods=0), "periods = 0 must be 1 or more"),
        (lambda: Lobes((1e3,), (-1.0,)), "half_sine: frequency = -1.0"),
        (lambda: Sine(1e3, 1.0, cycles=0.0), "sine: cycles = 0.0"),
        (lambda: Ramp(1e3, -1.0), "ramp: duration = -1.0"),
        (lambda: Hold(0.0), "hold: duration = 0.0"),
        (lambda: Steps((), 1.0), "steps: levels is empty"),
        (lambda: Steps((1e3,), 0.1, 0.2), "rise = 0.2 s is longer than dwell = 0.1 s"),
        (lambda: Chirp(1e3, 1.0, 2.0, 1.0, taper=0.6), r"taper = 0.6 s must lie in \(0, 0.5\]"),
        (lambda: Multisine(1e3, (), 1.0), "multisine: frequencies is empty"),
        (lambda: Multisine(1e3, (1.0, -2.0), 1.0), r"frequencies\[1\] = -2.0"),
        (lambda: Sampled(np.arange(3.0), np.arange(2.0)), "two columns of one length"),
        (
            lambda: Sampled(np.array([0.0, 2.0, 1.0]), np.zeros(3)),
            "time does not increase from row 2",
        ),
        (lambda: Sampled(np.arange(2.0), np.array([0.0, math.inf])), "voltage in row 2"),
        (lambda: Sequence("x", (Hold(1.0),), lead_in=-1.0), "lead_in = -1.0 s"),
        (lambda: Sequence.thesis().sample(0.0), "sample rate 0.0 Hz"),
        (lambda: Sequence("x", (Hold(1e6),)).sample(1e6), "shorten it or lower the rate"),
    ],
)
def test_refusals(build, message):
    with pytest.raises(ModelError, match=message):
        build()


@pytest.mark.parametrize("rate", [100.0, 999.0, 1000.0, 44100.0 / 7.0])
def test_boundaries_need_not_fall_on_ticks(rate):
    sequence = Sequence.thesis()
    time, voltage = sequence.sample(rate)
    np.testing.assert_array_equal(time, np.arange(time.size) / rate)
    inside = (time >= 2.0) & (time < 2.0 + 2.0 * Lobes().period)
    expected = np.array([thesis_v(t - 2.0) for t in time[inside]])
    np.testing.assert_allclose(voltage[inside], expected, atol=1e-6)
    assert (voltage[~inside] == 0.0).all()
    assert voltage[-1] == 0.0
    assert time[-1] >= sequence.duration - 1e-9
    assert time[-2] < sequence.duration


def test_outside_the_run_there_is_no_voltage():
    sequence = Sequence("x", (HalfSine(5e3, 1.0),))
    assert (sequence.voltage(np.array([-1.0, 0.5, 3.5, 99.0])) == 0.0).all()
    assert sequence.duration == 4.0
    np.testing.assert_allclose(sequence.boundaries, [2.0, 3.0])


VOLTS = st.floats(0.0, 1e4)
LENGTHS = st.floats(0.05, 3.0)
PIECES = st.one_of(
    st.builds(HalfSine, VOLTS, st.floats(0.2, 20.0)),
    st.builds(Triangle, VOLTS, st.floats(0.2, 20.0)),
    st.builds(Ramp, VOLTS, LENGTHS),
    st.builds(Hold, LENGTHS),
    st.builds(
        lambda v, d: Steps(tuple(v), d, 0.02), st.lists(VOLTS, min_size=1, max_size=4), LENGTHS
    ),
)


@settings(max_examples=60)
@given(pieces=st.lists(PIECES, min_size=1, max_size=6), rate=st.floats(200.0, 5000.0))
def test_what_is_joined_is_continuous_and_unipolar(pieces, rate):
    joined, end = [], 0.0
    for piece in pieces:
        if isinstance(piece, HalfSine | Triangle) and end != 0.0:
            joined.append(Ramp(0.0, 0.1))
        joined.append(piece)
        end = piece.after(end).end
    joined.append(Ramp(0.0, 0.05))
    sequence = Sequence("random", tuple(joined))
    _, voltage = sequence.sample(rate)
    assert voltage.min() >= 0.0
    assert voltage.max() <= 1e4
    # steps in 20 ms and lobes of 20 Hz at 10 kV are the steepest there are
    steepest = max(1e4 / 0.02, 1e4 * math.pi * 20.0)
    assert np.abs(np.diff(voltage)).max() <= 1.001 * steepest / rate + 1e-2
