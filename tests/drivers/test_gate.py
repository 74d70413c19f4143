"""The one gate: nothing beyond a limit passes, and nothing gets out another way."""

import copy
import math
import pickle
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dearig.drivers.errors import RefusedWaveform
from dearig.drivers.gate import FilmForecast, GatedWaveform, Limits, admit, ramp_down

LIMITS = Limits(
    voltage_min=-1000.0,
    voltage_max=8000.0,
    slew=4.0e5,
    field=1.0e7,
    energy=0.02,
    at_voltage=5000.0,
    time_at_voltage=0.004,
    film="F7",
)
WIDE = replace(LIMITS, slew=2e7, energy=1.0)
RATE = 1000.0
FIELD = 1.0e3
CAPACITANCE = 5.0e-10

any_float = st.floats(allow_nan=True, allow_infinity=True)
near_limits = st.floats(min_value=-2000.0, max_value=9000.0)


def gate(voltage, rate=RATE, limits=LIMITS, field=FIELD):
    voltage = np.asarray(voltage, dtype=float)
    return admit(voltage, rate, limits, foreseen(voltage.shape, field))


def foreseen(shape, field=FIELD, volume=CAPACITANCE / FIELD**2, **more):
    return FilmForecast(np.full(shape, field), volume, **{"film": "F7", **more})


def within(voltage, field_per_volt, limits=LIMITS, rate=RATE):
    """The same limits, said another way."""
    voltage, field_per_volt = voltage.tolist(), field_per_volt.tolist()
    energy, standing = 0.0, 0
    if not all(math.isfinite(v) for v in voltage) or voltage[0] != 0.0 or voltage[-1] != 0.0:
        return False
    if not all(math.isfinite(f) and f > 0.0 for f in field_per_volt):
        return False
    for i, v in enumerate(voltage):
        if v > limits.voltage_max or v < limits.voltage_min:
            return False
        if abs(v) * field_per_volt[i] > limits.field:
            return False
        if i and abs(v - voltage[i - 1]) * rate > limits.slew:
            return False
        before = voltage[i - 1] if i else 0.0
        energy += max(0.0, 0.5 * CAPACITANCE * (v * v - before * before))
        standing = standing + 1 if abs(v) >= limits.at_voltage else 0
        if standing > limits.time_at_voltage * rate:
            return False
    return energy <= limits.energy * (1.0 + 1e-12)


@settings(max_examples=150)
@given(
    st.lists(st.one_of(any_float, near_limits), max_size=12),
    st.one_of(any_float, st.floats(min_value=500.0, max_value=2000.0)),
)
def test_what_passes_is_within_every_limit_and_what_is_refused_is_not(inside, field):
    voltage = np.array([0.0, *inside, 0.0])
    if within(voltage, np.full(voltage.size, field)):
        np.testing.assert_array_equal(gate(voltage, field=field).window(), voltage)
    else:
        with pytest.raises(RefusedWaveform):
            gate(voltage, field=field)


@settings(max_examples=50)
@given(arrays(np.float64, st.integers(2, 20), elements=any_float))
def test_any_numbers_at_all_pass_only_within_the_limits(voltage):
    try:
        passed = gate(voltage)
    except RefusedWaveform:
        return
    assert within(passed.window(), np.full(voltage.size, FIELD))


@pytest.mark.parametrize(
    ("voltage", "message"),
    [
        ([0, 8000.1, 0], "voltage reaches 8.0001 kV at 0.001 s, 8 kV is allowed"),
        ([0, -1000.5, 0], "negative voltage reaches 1.0005 kV at 0.001 s, 1 kV is allowed"),
        ([0, 1e308, -1e308, 0], "slew reaches inf kV/s"),
        ([0, 500.0, 0], "slew reaches 500 kV/s at 0 s, 400 kV/s is allowed"),
        ([0, math.nan, 0], r"sample 1 \(at 0.001 s\) is not a finite number"),
        ([0, 100, math.inf], "sample 2 .* is not a finite number"),
        ([1, 0, 0], "the waveform starts at 0.001 kV, not at 0"),
        ([0, 0, 1], "the waveform ends at 0.001 kV, not at 0"),
        ([0.0], "at least 2 samples"),
        ([], "at least 2 samples"),
        ([[0.0, 0.0]], "one row"),
    ],
)
def test_refusals_say_what_when_and_how_much(voltage, message):
    with pytest.raises(RefusedWaveform, match=message):
        gate(voltage)


def test_a_refusal_names_every_limit_that_is_broken():
    with pytest.raises(RefusedWaveform) as caught:
        gate([0.0, 9000.0, 500.0], field=2.0e3)
    assert len(caught.value.reasons) == 5  # voltage, slew, field, energy, end


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf])
def test_rates_that_are_none(rate):
    with pytest.raises(RefusedWaveform, match="sample rate"):
        gate([0.0, 0.0], rate=rate)


@pytest.mark.parametrize("field", [0.0, -1.0])
def test_field_factors_that_are_none(field):
    with pytest.raises(RefusedWaveform, match="one over the thickness is predicted as"):
        gate([0.0, 0.0], field=field)


def test_predictions_must_be_as_many_as_samples():
    with pytest.raises(RefusedWaveform, match="not that of a waveform of 3 samples"):
        admit(np.zeros(3), RATE, LIMITS, foreseen(2))


@pytest.mark.parametrize("volume", [0.0, -1e-10, math.nan, math.inf])
def test_films_that_are_none(volume):
    with pytest.raises(RefusedWaveform, match="permittivity times its volume is predicted as"):
        admit(np.zeros(3), RATE, LIMITS, foreseen(3, volume=volume))


@settings(max_examples=100)
@given(
    st.lists(st.floats(-1500.0, 9000.0), min_size=1, max_size=40),
    st.integers(1, 5),
    st.integers(2, 9),
)
def test_the_pieces_in_which_it_is_judged_do_not_matter(inside, stride, piece):
    voltage = np.array([0.0, *inside, 0.0])
    field = FIELD * (1.0 + 0.01 * np.arange(-(-voltage.size // stride)))
    seen = []
    for size in (piece, 10**6):
        with patch("dearig.drivers.gate._PIECE", size):
            try:
                passed = admit(
                    voltage, RATE, WIDE, FilmForecast(field, 5e-16, film="F7", stride=stride)
                )
                seen.append([m.reached for m in passed.margins])
            except RefusedWaveform as refused:
                seen.append(refused.reasons)
    assert seen[0] == pytest.approx(seen[1]) if isinstance(seen[1], list) else seen[0] == seen[1]


def test_a_prediction_holds_for_its_stride():
    voltage = np.array([0.0, 100.0, 200.0, 100.0, 0.0])
    field = np.array([1e3, 2e3, 1e3])
    passed = admit(voltage, RATE, LIMITS, FilmForecast(field, 5e-16, film="F7", stride=2))
    assert passed.margins[3].reached == pytest.approx(0.4)  # 200 V where the film is thin


def test_a_predicted_pull_in_is_refused():
    with pytest.raises(RefusedWaveform, match="the model predicts pull-in"):
        admit(np.zeros(3), RATE, LIMITS, foreseen(3, pull_in="pull-in (at 1 s)"))


@pytest.mark.parametrize(("film", "said"), [("F8", "for film 'F8'"), ("", "without a name")])
def test_limits_hold_for_the_film_they_are_declared_for(film, said):
    with pytest.raises(RefusedWaveform, match=f"declared for film 'F7', not .*{said}"):
        admit(np.zeros(3), RATE, LIMITS, foreseen(3, film=film))


def test_energy_counts_every_rise_and_no_fall():
    step = [0.0, 300.0, 0.0]
    rises = gate([*step * 10]).margins[4]
    assert rises.quantity == "energy"
    assert rises.reached == pytest.approx(10 * 0.5 * CAPACITANCE * 300.0**2)
    with pytest.raises(RefusedWaveform, match=r"energy reaches 0\.0\d+ J, 0\.02 J is allowed"):
        gate([*step * 1000])


def test_time_at_voltage_is_what_stands_without_a_pause():
    rise = np.linspace(0.0, 4900.0, 20)
    high, low = [5000.0] * 4, [4999.0]
    gate([*rise, *high, *low, *high, *rise[::-1]])
    with pytest.raises(RefusedWaveform, match=r"time at 5 kV or more reaches 0\.005 s, 0\.004 s"):
        gate([*rise, *high, 5000.0, *rise[::-1]])


@pytest.mark.parametrize(
    "name",
    ["voltage_min", "voltage_max", "slew", "field", "energy", "at_voltage", "time_at_voltage"],
)
def test_a_limit_that_is_no_number_lets_nothing_pass(name):
    limits = Limits(**{**vars(LIMITS), name: math.nan})
    with pytest.raises(RefusedWaveform, match="nan"):
        gate([0.0, 0.0], limits=limits)


def test_margins_say_how_near_it_comes():
    margins = {m.quantity: m for m in gate([0.0, 200.0, 0.0]).margins}
    assert margins["voltage"].reached == pytest.approx(0.2)
    assert margins["slew"].reached == pytest.approx(200.0)
    assert margins["true field"].reached == pytest.approx(0.2)
    assert margins["true field"].unit == "MV/m"
    assert str(margins["negative voltage"].reached) == "0.0"


@pytest.mark.parametrize("part", [1.0, 1.0 + 2e-3, 1.0 - 2e-3])
def test_a_rate_that_a_card_rounds_is_played(part):
    gate(np.zeros(4)).check_rate(part * RATE)


@pytest.mark.parametrize("part", [1.613, 1.01, 0.99, 0.0, -1.0, math.nan, math.inf])
def test_a_rate_that_was_not_judged_is_refused(part):
    # at 1.6 times the rate the slew is 1.6 times what passed
    with pytest.raises(RefusedWaveform, match="in place of 1000 Hz"):
        gate(np.zeros(4)).check_rate(part * RATE)


def test_no_other_way_in():
    with pytest.raises(TypeError, match=r"only drivers\.gate\.admit can make"):
        GatedWaveform(np.zeros(2), RATE, LIMITS, (), object())
    with pytest.raises(TypeError, match="cannot be derived"):
        type("Forged", (GatedWaveform,), {})


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_no_copies(copied):
    with pytest.raises(TypeError, match="admit the waveform again"):
        copied(gate([0.0, 0.0]))


def test_unchangeable_afterwards():
    source = np.array([0.0, 100.0, 0.0])
    passed = gate(source)
    source[1] = 1e9
    assert passed.window()[1] == 100.0
    with pytest.raises(ValueError, match="read-only"):
        passed.window()[1] = 1e9
    with pytest.raises(ValueError, match="cannot set WRITEABLE"):
        passed.window().setflags(write=True)
    for name in ("voltage", "rate", "_voltage", "_limits"):
        with pytest.raises(AttributeError, match="cannot be changed after the gate"):
            setattr(passed, name, None)


@pytest.mark.parametrize(
    ("peak", "duration", "steps"),
    [(400.0, 0.01, 10), (-400.0, 0.01, 10), (400.0, 0.0, 1), (0.0, 1.0, 0), (1200.0, 0.0, 3)],
)
def test_ramp_down_goes_straight_to_zero_within_the_slew(peak, duration, steps):
    rise = np.linspace(0.0, peak, 10)
    limits = replace(LIMITS, voltage_min=-2000.0, voltage_max=2000.0)
    passed = gate([*rise, *rise[::-1]], limits=limits)
    ramp = ramp_down(passed, 9, duration)
    assert ramp.size == steps
    whole = np.array([peak, *ramp])
    assert whole[-1] == 0.0
    np.testing.assert_allclose(np.diff(whole, 2), 0.0, atol=1e-9)
    assert np.all(np.abs(np.diff(whole)) * RATE <= limits.slew * (1.0 + 1e-12))
