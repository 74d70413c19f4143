"""Tests that every amplifier's driver must pass.

Derive a class ``Test...`` from ``AmplifierContract`` and return the driver from ``driver``.
"""

from __future__ import annotations

import math

import pytest

from dearig.drivers.instruments.amplifier import AmplifierDriver, Monitors
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import AmplifierSettings, RigSettings

__all__ = ["AmplifierContract"]


def wrong(findings: tuple[Finding, ...]) -> list[Finding]:
    """Return the findings that prevent a run."""
    return [finding for finding in findings if finding.verdict == "wrong"]


class AmplifierContract:
    """Tests of an amplifier's driver; a derived class must define ``driver`` only."""

    def driver(self) -> AmplifierDriver:
        """Return the driver of a working amplifier at 0 V."""
        raise NotImplementedError

    def settings(self, **amplifier: float | str) -> RigSettings:
        """Return the settings of a rig with the driver's amplifier."""
        return RigSettings(amplifier=AmplifierSettings.model_validate(amplifier))

    def test_driver_can_be_registered(self) -> None:
        driver = self.driver()
        assert isinstance(driver, AmplifierDriver)
        assert driver.role == "amplifier"

    def test_findings_name_the_amplifier(self) -> None:
        settings = self.settings(model="the amplifier of this test", serial="4711")
        findings = self.driver().inspect(settings, Monitors(0.0, 0.0))
        assert {finding.instrument for finding in findings} == {"the amplifier of this test"}
        assert any("4711" in finding.found for finding in findings)

    def test_scaling_in_force_is_said(self) -> None:
        settings = self.settings(monitor_V_per_kV=0.8)
        findings = self.driver().inspect(settings, Monitors(0.0, 0.0))
        assert any("0.8 V/kV" in finding.found for finding in findings)
        assert any("1000 V/V" in finding.found for finding in findings)

    def test_monitors_at_zero_are_in_order(self) -> None:
        assert wrong(self.driver().inspect(self.settings(), Monitors(99.0, -0.79e-3))) == []

    @pytest.mark.parametrize(
        "monitors",
        [
            Monitors(101.0, 0.0),
            Monitors(-8000.0, 0.0),
            Monitors(0.0, 0.81e-3),
            Monitors(0.0, -2e-3),
            Monitors(math.nan, 0.0),
            Monitors(0.0, math.inf),
        ],
    )
    def test_a_voltage_or_current_that_should_not_be_there_is_wrong(
        self, monitors: Monitors
    ) -> None:
        (finding,) = wrong(self.driver().inspect(self.settings(), monitors))
        assert "keep away from the film" in finding.advice

    def test_monitors_that_were_not_read_are_not_in_order(self) -> None:
        findings = self.driver().inspect(self.settings(), None)
        assert "warning" in {finding.verdict for finding in findings}
