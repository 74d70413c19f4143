"""Tests that every laser's driver must pass.

Derive a class ``Test...`` from ``LaserContract``. Its ``connected`` brings a laser, real or
simulated, into each of the tested states.
"""

from __future__ import annotations

from contextlib import AbstractContextManager

import pytest

from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.laser import LaserDriver, LaserInspection, analog_findings
from dearig.drivers.settings import LaserSettings

__all__ = ["LaserContract"]


def wrong(inspection: LaserInspection) -> list[Finding]:
    """Return the findings that prevent a run."""
    return [finding for finding in inspection.findings if finding.verdict == "wrong"]


class LaserContract:
    """Tests of a laser's driver; a derived class must define ``connected`` only."""

    TOLERANCE = 1e-6  # m, between the reading and the target's position
    PLACE = 6.4e-3  # m, position of a target within the range

    def connected(
        self, *, reading: float | None = PLACE, answers: bool = True, agrees: bool = True
    ) -> AbstractContextManager[tuple[LaserDriver, LaserSettings]]:
        """Return a driver, and the settings under which it finds its laser, for one test.

        The target is at ``reading`` m, or out of range with None. With ``answers`` False nothing is
        connected to the line. With ``agrees`` False the scale of the laser's analog output differs
        from the settings.
        """
        raise NotImplementedError

    def test_driver_can_be_registered(self) -> None:
        with self.connected() as (driver, _):
            assert isinstance(driver, LaserDriver)
            assert driver.role == "laser"

    def test_without_a_port_nothing_is_asked(self) -> None:
        with self.connected(answers=False) as (driver, settings):
            found = driver.inspect(settings.model_copy(update={"port": ""}))
        assert [finding.verdict for finding in found.findings] == ["not wired"]
        assert found.reading is None

    def test_a_laser_in_order_says_what_and_where_it_is(self) -> None:
        with self.connected() as (driver, settings):
            found = driver.inspect(settings)
        assert wrong(found) == []
        assert found.findings[0].instrument == settings.model
        assert settings.port in found.findings[0].found

    def test_reading_is_the_target_s_place(self) -> None:
        with self.connected() as (driver, settings):
            found = driver.inspect(settings)
        assert found.reading == pytest.approx(self.PLACE, abs=self.TOLERANCE)

    def test_scale_of_the_analog_output_is_the_laser_s_own(self) -> None:
        with self.connected() as (driver, settings):
            found = driver.inspect(settings)
        scale = settings.direction * settings.mm_per_V * 1e-3
        assert found.metres_per_volt == pytest.approx(scale, rel=1e-4)
        volts = self.PLACE / scale
        in_order = analog_findings(settings, volts, found)
        assert [finding.verdict for finding in in_order] == ["ok", "ok"]
        off = analog_findings(settings, 0.5 * volts, found)
        assert off[-1].verdict == "wrong"
        assert off[-1].advice

    def test_another_scale_than_the_rig_file_s_is_wrong(self) -> None:
        with self.connected(agrees=False) as (driver, settings):
            found = driver.inspect(settings)
        assert wrong(found)
        assert all(finding.wanted for finding in wrong(found))

    def test_a_target_out_of_sight_is_wrong_and_no_reading(self) -> None:
        with self.connected(reading=None) as (driver, settings):
            found = driver.inspect(settings)
        assert found.reading is None
        assert wrong(found)
        assert all(finding.advice for finding in wrong(found))

    def test_a_laser_that_does_not_answer_is_a_finding_with_advice(self) -> None:
        with self.connected(answers=False) as (driver, settings):
            found = driver.inspect(settings)
        assert len(wrong(found)) == 1
        assert wrong(found)[0].advice
        assert found.reading is None

    def test_inspecting_twice_finds_the_same(self) -> None:
        with self.connected() as (driver, settings):
            assert driver.inspect(settings) == driver.inspect(settings)
