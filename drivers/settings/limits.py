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
        description="fastest change of the voltage; 1500 allows a rounded rise to 8 kV in 10 ms",
    )
    true_field_max_MV_per_m: float = Field(
        default=15.0, gt=0.0, le=1000.0, description="highest true field in the stretched film"
    )
    energy_max_J: float = Field(
        default=1000.0,
        gt=0.0,
        le=1e9,
        description="most energy that a run may charge into the film, summed over all its rises",
    )
    at_voltage_kV: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="voltage from which the film counts as standing at voltage",
    )
    time_at_voltage_max_s: float = Field(
        default=600.0, gt=0.0, le=1e7, description="longest time at voltage without a pause"
    )
    ramp_down_s: float = Field(
        default=0.5,
        ge=0.0,
        le=60.0,
        description="time of the ramp to 0 V when a run is ended early",
    )
    zero_tolerance_kV: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="voltage below which the monitor must read once the rig is safe",
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
    """Interlocks that end a run in progress: threshold, debounce time and action of each."""

    monitor_tolerance_kV: float = Field(
        default=1.5,
        gt=0.0,
        le=100.0,
        description="largest difference of the voltage monitor from the command; an amplifier that "
        "loses 15 % at 8 kV passes",
    )
    monitor_debounce_ms: float = Field(
        default=50.0,
        ge=0.0,
        le=1e4,
        description="time of a larger difference after which the interlock trips",
    )
    monitor_action: Action = Field(default="ramp", description="how the voltage goes to 0 V")
    breakdown_fraction: float = Field(
        default=0.4,
        ge=0.0,
        le=1.0,
        description="part of a command above breakdown_above_kV; a monitor below it shows a "
        "breakdown, or an amplifier that tripped; 0 switches the interlock off",
    )
    breakdown_above_kV: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="command above which breakdown_fraction applies",
    )
    breakdown_debounce_ms: float = Field(
        default=2.0,
        ge=0.0,
        le=1e4,
        description="time below that part after which the interlock trips",
    )
    breakdown_action: Action = Field(default="at once", description="how the voltage goes to 0 V")
    current_max_mA: float = Field(
        default=20.0,
        gt=0.0,
        le=1000.0,
        description="largest current at the current monitor, either sign",
    )
    current_debounce_ms: float = Field(
        default=2.0,
        ge=0.0,
        le=1e4,
        description="time of a larger current after which the interlock trips",
    )
    current_action: Action = Field(default="at once", description="how the voltage goes to 0 V")
    laser_debounce_ms: float = Field(
        default=50.0,
        ge=0.0,
        le=1e4,
        description="time of a reading out of the laser's range after which the interlock trips",
    )
    laser_stuck_s: float = Field(
        default=0.5,
        ge=0.0,
        le=1e4,
        description="time of a reading that does not change by one count while the command moves "
        "by laser_stuck_swing_kV, after which the interlock trips; 0 switches this off",
    )
    laser_stuck_swing_kV: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="movement of the command within laser_stuck_s that must change the reading",
    )
    laser_action: Action = Field(default="ramp", description="how the voltage goes to 0 V")
    displacement_min_mm: float = Field(
        default=-20.0,
        ge=-1e4,
        le=0.0,
        description="lowest displacement from the loaded rest state",
    )
    displacement_max_mm: float = Field(
        default=25.0,
        gt=0.0,
        le=1e4,
        description="highest displacement from the loaded rest state",
    )
    displacement_jump_mm: float = Field(
        default=2.0,
        gt=0.0,
        le=1e4,
        description="largest distance of a reading from the straight line through those 2 ms and "
        "4 ms before (or one and two samples); the limit grows with the square of a sample "
        "interval above 4 ms",
    )
    displacement_debounce_ms: float = Field(
        default=5.0,
        ge=0.0,
        le=1e4,
        description="time out of bounds after which the interlock trips; a jump trips it at once",
    )
    displacement_action: Action = Field(default="ramp", description="how the voltage goes to 0 V")
    following_fraction: float = Field(
        default=0.2,
        ge=0.0,
        le=1.0,
        description="part of a predicted displacement above following_above_mm; a film that "
        "moves less does not follow (an open electrode); 0 switches the interlock off",
    )
    following_above_mm: float = Field(
        default=0.3,
        gt=0.0,
        le=1e4,
        description="predicted displacement above which following_fraction applies",
    )
    following_debounce_ms: float = Field(
        default=200.0,
        ge=0.0,
        le=1e4,
        description="time without following after which the interlock trips, not counting the "
        "time between such displacements",
    )
    following_action: Action = Field(default="ramp", description="how the voltage goes to 0 V")
    late_s: float = Field(
        default=1.0,
        gt=0.0,
        le=60.0,
        description="time for which samples wait for the program after which the interlock trips",
    )
    late_action: Action = Field(default="ramp", description="how the voltage goes to 0 V")
    disk_free_min_MB: float = Field(
        default=100.0, ge=0.0, le=1e6, description="space on the disk that must stay free"
    )
    disk_action: Action = Field(default="ramp", description="how the voltage goes to 0 V")


class GuardianSettings(Section):
    """The guardian process, which takes over when a run on real instruments dies or freezes."""

    timeout_s: float = Field(
        default=1.0,
        ge=0.3,
        le=10.0,
        description="time of silence after which the run counts as frozen",
    )
    link_timeout_s: float = Field(
        default=2.0,
        ge=0.2,
        le=60.0,
        description="time without an answer after which the server counts as lost",
    )
    retry_s: float = Field(
        default=20.0,
        ge=0.2,
        le=600.0,
        description="time for which the guardian repeats its attempts to set 0 V, where the card "
        "does not answer",
    )
