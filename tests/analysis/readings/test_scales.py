"""Uncertainties of scales are those that the rig file states; others are taken."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from dearig.analysis.readings.scales import scale_errors
from dearig.model.readings.channels import CURRENT, GAIN_ERROR, VOLTAGE_MONITOR

STATED = """\
[amplifier]
gain_V_per_V = 1000.0
gain_V_per_V_uncertainty = 3.0
current_monitor_V_per_mA = 0.25
current_monitor_V_per_mA_uncertainty = 0.001
[film]
thickness_mm = 1.0
thickness_mm_uncertainty = 0.02
"""


def recording(text: str = "", average: int = 1, skew: float = 3e-6, rate: float = 1e5):
    """What is read of a recording of one second."""
    rows = round(rate / average) + 1
    current = SimpleNamespace(name="current_monitor", skew=skew)
    return SimpleNamespace(
        provenance={"configuration": text}, average=average, samples=rows, duration=1.0,
        channels=(current,),
    )  # fmt: skip


def test_stated_uncertainties_are_relative_and_joined():
    found = scale_errors(recording(STATED))
    assert (found.command, found.monitor) == (pytest.approx(3e-3), None)
    assert found.of_channel(CURRENT) == pytest.approx(5e-3)  # 4e-3 and 3e-3
    assert found.of_channel(VOLTAGE_MONITOR) == pytest.approx(3e-3)
    assert found.of_charge("command") == pytest.approx((5e-3**2 + 0.02**2) ** 0.5)
    assert found.of_charge("monitor") > found.of_charge("command")  # 1 % is taken for its scale


@pytest.mark.parametrize("text", ["", "[amplifier]\nof_another_version = 3\n", "no TOML"])
def test_one_per_cent_is_taken_where_nothing_is_stated(text):
    found = scale_errors(recording(text))
    assert found.of_channel(CURRENT) == GAIN_ERROR
    assert found.of_charge("command") == pytest.approx(2.0**0.5 * GAIN_ERROR)


def test_conversions_at_all_times_after_a_step_weigh_as_the_current():
    weights = [scale_errors(recording("", 100, 1e-6 * s, 1e5)).weight for s in range(10)]
    assert sum(weights) / len(weights) == pytest.approx(1.0, abs=0.01)
    assert max(weights) > 1.05 > 0.9 > min(weights)
    # many conversions within the pulse weigh as it does
    assert scale_errors(recording("", 100, 1e-7, 5e6)).weight == pytest.approx(1.0, abs=1e-3)


def test_instants_have_no_weight():
    assert scale_errors(recording()).weight == 1.0
