"""Settings of a run's limits, interlocks and guardian."""

from __future__ import annotations

from pydantic import Field

from dearig.drivers.gate import Limits
from dearig.drivers.settings.section import Action, Section

__all__ = ["GuardianSettings", "InterlockSettings", "LimitsSettings"]


class LimitsSettings(Section):
    """Limits of the film and the amplifier; the gate checks every sample against them."""

    voltage_max_kV: float = Field(
        default=8.5, gt=0.0, le=100.0, description="highest voltage at the film"
    )
    voltage_min_kV: float = Field(
        default=0.0, ge=-100.0, le=0.0, description="lowest voltage at the film; 0 means unipolar"
    )
    slew_max_kV_per_s: float = Field(
        default=1500.0,
        gt=0.0,
        le=1e6,
        description="fastest change; 1500 passes a rounded rise to 8 kV in 10 ms",
    )
    true_field_max_MV_per_m: float = Field(
        default=15.0, gt=0.0, le=1000.0, description="highest true field in the stretched film"
    )
    energy_max_J: float = Field(
        default=1000.0,
        gt=0.0,
        le=1e9,
        description="most energy that a run may charge into the film, over all its rises",
    )
    at_voltage_kV: float = Field(
        default=1.0, gt=0.0, le=100.0, description="voltage from which time_at_voltage_max_s counts"
    )
    time_at_voltage_max_s: float = Field(
        default=600.0, gt=0.0, le=1e7, description="longest time at voltage without a pause"
    )
    ramp_down_s: float = Field(
        default=0.5, ge=0.0, le=60.0, description="time to ramp to 0 V when a run is ended early"
    )
    zero_tolerance_kV: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="the voltage monitor must read less than this when the rig is safe",
    )

    def gate_limits(self, film: str = "") -> Limits:
        """Return the limits for the gate, in SI units, for the film of that name."""
        return Limits(
            voltage_min=self.voltage_min_kV * 1e3,
            voltage_max=self.voltage_max_kV * 1e3,
            slew=self.slew_max_kV_per_s * 1e3,
            field=self.true_field_max_MV_per_m * 1e6,
            energy=self.energy_max_J,
            at_voltage=self.at_voltage_kV * 1e3,
            time_at_voltage=self.time_at_voltage_max_s,
            film=film,
        )


class InterlockSettings(Section):
    """Interlocks that end a run: thresholds, debounce times and actions."""

    monitor_tolerance_kV: float = Field(
        default=1.5,
        gt=0.0,
        le=100.0,
        description="voltage monitor against command; an amplifier that loses 15 % at 8 kV passes",
    )
    monitor_debounce_ms: float = Field(default=50.0, ge=0.0, le=1e4, description="debounce time")
    monitor_action: Action = Field(default="ramp", description="action")
    breakdown_fraction: float = Field(
        default=0.4,
        ge=0.0,
        le=1.0,
        description="a monitor below this part of a command above breakdown_above_kV is a "
        "breakdown, or an amplifier that tripped; 0 switches it off",
    )
    breakdown_above_kV: float = Field(default=0.5, gt=0.0, le=100.0, description="see above")
    breakdown_debounce_ms: float = Field(default=2.0, ge=0.0, le=1e4, description="debounce time")
    breakdown_action: Action = Field(default="at once", description="action")
    current_max_mA: float = Field(
        default=20.0, gt=0.0, le=1000.0, description="current monitor, either sign"
    )
    current_debounce_ms: float = Field(default=2.0, ge=0.0, le=1e4, description="debounce time")
    current_action: Action = Field(default="at once", description="action")
    laser_debounce_ms: float = Field(
        default=50.0,
        ge=0.0,
        le=1e4,
        description="debounce time of a reading out of the laser's range",
    )
    laser_stuck_s: float = Field(
        default=0.5,
        ge=0.0,
        le=1e4,
        description="time for which the reading stays at one count while the command "
        "moves by laser_stuck_swing_kV; 0 switches it off",
    )
    laser_stuck_swing_kV: float = Field(default=1.0, gt=0.0, le=100.0, description="see above")
    laser_action: Action = Field(default="ramp", description="action")
    displacement_min_mm: float = Field(
        default=-20.0, ge=-1e4, le=0.0, description="from the loaded rest state"
    )
    displacement_max_mm: float = Field(
        default=25.0, gt=0.0, le=1e4, description="from the loaded rest state"
    )
    displacement_jump_mm: float = Field(
        default=2.0,
        gt=0.0,
        le=1e4,
        description="reading beside the straight line through those 2 ms and 4 ms before (or one "
        "and two samples); grows with the square of a sample interval above 4 ms",
    )
    displacement_debounce_ms: float = Field(
        default=5.0, ge=0.0, le=1e4, description="debounce time; a jump trips at once"
    )
    displacement_action: Action = Field(default="ramp", description="action")
    following_fraction: float = Field(
        default=0.2,
        ge=0.0,
        le=1.0,
        description="a film that moves less than this part of a predicted displacement above "
        "following_above_mm does not follow (an open electrode); 0 switches it off",
    )
    following_above_mm: float = Field(default=0.3, gt=0.0, le=1e4, description="see above")
    following_debounce_ms: float = Field(
        default=200.0,
        ge=0.0,
        le=1e4,
        description="debounce time, not counting the time between such displacements",
    )
    following_action: Action = Field(default="ramp", description="action")
    late_s: float = Field(
        default=1.0, gt=0.0, le=60.0, description="time for which samples wait for the program"
    )
    late_action: Action = Field(default="ramp", description="action")
    disk_free_min_MB: float = Field(
        default=100.0, ge=0.0, le=1e6, description="disk space that must stay free"
    )
    disk_action: Action = Field(default="ramp", description="action")


class GuardianSettings(Section):
    """The guardian process, which takes over when a run on real instruments dies or freezes."""

    timeout_s: float = Field(
        default=1.0,
        ge=0.3,
        le=10.0,
        description="a run that is silent for this time counts as frozen",
    )
    link_timeout_s: float = Field(
        default=2.0,
        ge=0.2,
        le=60.0,
        description="a server that does not answer for this time counts as lost",
    )
