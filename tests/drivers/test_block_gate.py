"""The gate of a voltage that is corrected while it is played: block after block, or none."""

import math
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.drivers import gate
from dearig.drivers.errors import ChangedWaveform, RefusedWaveform
from dearig.drivers.gate import BlockGate, FilmForecast, Limits, admit, open_block_gate
from dearig.drivers.samples import Computed

LIMITS = Limits(
    voltage_min=0.0, voltage_max=8000.0, slew=4e5, field=1e7, energy=10.0, at_voltage=5000.0,
    time_at_voltage=1.0, film="F7",
)  # fmt: skip
RATE, BLOCK = 1000.0, 10
FIELD = 1e3
AUTHORITY, CHANGE = 0.1, 2.0  # 1/s: 0.02 in a block

corrections = st.lists(
    st.one_of(
        st.floats(-0.13, 0.13),
        st.floats(allow_nan=True, allow_infinity=True),
        st.sampled_from([0.0, 0.01, 0.1, -0.1, 1e308, -0.0]),
    ),
    max_size=30,
)
small_steps = st.lists(st.floats(-0.025, 0.025), max_size=30)


def feedforward(level=6000.0, held=200, limits=LIMITS):
    rise = level * np.linspace(0.0, 1.0, 30)
    voltage = np.concatenate((np.zeros(15), rise, np.full(held, level), rise[::-1], np.zeros(12)))
    return admit(voltage, RATE, limits, film(voltage.size))


def film(samples, field=FIELD, **more):
    return FilmForecast(np.full(samples, field), 5e-16, **{"film": "F7", **more})


def opened(played=None, *, block=BLOCK, authority=AUTHORITY, change=CHANGE, **films):
    played = played or feedforward()
    return open_block_gate(
        played, block=block, authority=authority, rate_limit=change,
        edge=films.get("edge", film(played.samples)),
        prediction=films.get("prediction", film(played.samples)),
    )  # fmt: skip


def passed(gate_: BlockGate, values) -> list[float]:
    """Give one correction after another until one is refused; return those that passed."""
    through = []
    for value in values:
        if gate_.complete:
            break
        before = gate_.waveform.admitted
        try:
            gate_.admit(value)
        except RefusedWaveform:
            assert gate_.waveform.admitted == before
            for further in (0.0, gate_.correction):
                with pytest.raises(RefusedWaveform, match="refused before"):
                    gate_.admit(further)
            break
        through.append(value)
    return through


@given(st.one_of(corrections, small_steps.map(lambda steps: list(np.cumsum(steps)))))
@settings(max_examples=60)
def test_whatever_is_asked_for_only_small_slow_corrections_within_the_limits_get_out(values):
    played = feedforward()
    gate_ = opened(played)
    through = passed(gate_, [float(v) for v in values])
    voltage, plan = gate_.waveform.window(), played.window(0, gate_.waveform.admitted)
    assert gate_.waveform.admitted == min(len(through) * BLOCK, played.samples)
    assert np.isfinite(voltage).all()
    assert np.all(np.abs(voltage - plan) <= AUTHORITY * plan * (1.0 + 1e-9))
    assert np.all(np.abs(np.diff(voltage, prepend=0.0)) * RATE <= LIMITS.slew)
    assert np.all((voltage >= 0.0) & (voltage <= LIMITS.voltage_max))
    relative = np.divide(voltage, plan, out=np.ones_like(plan), where=plan > 0.0)
    steady = np.flatnonzero((plan[1:] > 0.0) & (plan[:-1] > 0.0))
    assert np.all(np.abs(np.diff(relative))[steady] * RATE <= CHANGE * (1.0 + 1e-6))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 0.11, -0.11, 1e300, None, "0"])
def test_a_correction_that_is_none_is_refused(value):
    gate_ = opened(change=100.0)
    gate_.admit(0.1)
    assert passed(gate_, [value]) == []
    assert gate_.correction == 0.1


def test_a_correction_that_changes_too_fast_is_refused_with_both_numbers():
    gate_ = opened()
    gate_.admit(0.02)
    with pytest.raises(RefusedWaveform, match=r"sample 10 .* by 2\.1 1/s, 2 1/s is allowed"):
        gate_.admit(0.041)


def test_it_judges_as_the_gate_of_a_whole_waveform_does():
    rng = np.random.default_rng(3)
    gate_ = opened()
    while not gate_.complete:
        gate_.admit(float(np.clip(gate_.correction + rng.uniform(-0.01, 0.01), -0.1, 0.1)))
    whole = gate_.waveform.window()
    again = admit(whole, RATE, LIMITS, film(whole.size))
    assert [m.quantity for m in gate_.margins] == [m.quantity for m in again.margins]
    np.testing.assert_allclose(
        [m.reached for m in gate_.margins], [m.reached for m in again.margins], rtol=1e-12
    )
    with pytest.raises(RefusedWaveform, match="every block of the waveform is admitted"):
        gate_.admit(0.0)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"voltage_max": 6500.0}, r"voltage reaches 6\.6 kV"),
        ({"field": 6.3e6}, r"true field reaches 6\.6 MV/m"),
        ({"slew": 2.2e5}, r"slew reaches"),
        ({"energy": 0.0101}, r"energy reaches"),
        ({"at_voltage": 6100.0, "time_at_voltage": 0.1}, r"time at 6\.1 kV or more reaches"),
    ],
)  # fmt: skip
def test_the_limits_must_leave_room_for_the_whole_authority(limits, said):
    played = feedforward(limits=replace(LIMITS, **limits))
    with pytest.raises(RefusedWaveform, match=said):
        opened(played)


def test_what_adds_up_over_a_run_is_added_up_over_blocks():
    played = feedforward(limits=replace(LIMITS, energy=0.012))
    gate_ = opened(played, change=100.0)
    # to and fro: every rise takes energy, though each block alone is harmless
    through = passed(gate_, [0.0] * 6 + [0.1, -0.1] * 10)
    assert 6 < len(through) < 26
    assert played.samples > gate_.waveform.admitted


def test_a_film_that_would_pull_in_under_the_correction_is_refused():
    class Collapsing:
        electric_volume, film, pull_in = 5e-16, "F7", ""

        def fits(self, samples):  # noqa: ARG002
            return True

        def follow(self, start, voltage):  # noqa: ARG002
            self.pull_in = "pull-in (at 1 s)" if voltage.max() > 6100.0 else ""
            return np.full(voltage.size, FIELD)

    gate_ = opened(prediction=Collapsing(), change=100.0)
    assert passed(gate_, [0.0] * 10 + [0.01, 0.02]) == [0.0] * 10 + [0.01]


@pytest.mark.parametrize(
    "wrong",
    [{"block": 0}, {"authority": 1.0}, {"authority": -0.1}, {"authority": math.nan},
     {"change": 0.0}, {"change": math.inf}, {"prediction": film(3)}, {"edge": film(3)},
     {"edge": film(287, film="F8")}],
)  # fmt: skip
def test_what_is_no_limit_opens_no_gate(wrong):
    with pytest.raises(RefusedWaveform):
        opened(**wrong)


def test_without_authority_the_feedforward_alone_passes():
    assert passed(opened(authority=0.0), [0.0, 0.0, 1e-6, 0.0]) == [0.0, 0.0]


def test_no_other_way_in():
    played = feedforward()
    with pytest.raises(TypeError, match=r"only drivers\.gate\.open_block_gate"):
        BlockGate(played, played, film(played.samples), BLOCK, 0.1, 1.0, object())
    gate_ = opened(played)
    gate_.admit(0.0)
    with pytest.raises(RefusedWaveform, match="still grows"):
        opened(gate_.waveform)
    assert gate_.waveform.block == BLOCK
    assert played.block == 0


def test_samples_of_a_long_run_are_computed_again_and_compared():
    checked = feedforward().window()
    factor = 1.0
    source = Computed(checked.size, lambda start, stop: factor * checked[start:stop])
    with patch.multiple(gate, _PIECE=32, _KEPT=2):
        played = admit(source, RATE, LIMITS, film(checked.size))
        gate_ = opened(played)
        while not gate_.complete:
            gate_.admit(gate_.correction + 0.001)
        again = gate_.waveform.window(0, 64)
        assert np.all(np.abs(again - checked[:64]) <= 0.01 * checked[:64])
        factor = 0.5  # within all limits, and yet not what was checked
        with pytest.raises(ChangedWaveform):
            gate_.waveform.window(32, 64)
