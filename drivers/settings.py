"""Settings of the instruments as a rig file holds them, each with its unit in its name.

Defaults are the rig of the thesis (section 4.1) with its makers' figures, which are from memory:
check them against the manuals of the instruments at hand. Values marked "simulated rig only" say
how an instrument misbehaves; a real one needs no telling.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from dearig.drivers.channels import CHANNEL_NAMES, Channel, Scaling
from dearig.drivers.gate import Limits

__all__ = [
    "AmplifierSettings",
    "CardSettings",
    "GuardianSettings",
    "InterlockSettings",
    "LaserSettings",
    "LimitsSettings",
    "RigSettings",
    "Section",
    "ThermometerSettings",
]

_ZERO_CELSIUS = 273.15  # K

AnalogInput = Annotated[str, Field(pattern=r"^ai[0-9]{1,2}$")]
DigitalLine = Annotated[str, Field(pattern=r"^port[0-9]/line[0-9]{1,2}$")]
AnalogOutput = Annotated[str, Field(pattern=r"^ao[0-9]{1,2}$")]
InputRange = Annotated[float, Field(ge=0.1, le=10.0)]
Terminals = Literal["DIFF", "RSE", "NRSE"]
Action = Literal["ramp", "at once"]


class Section(BaseModel):
    """One table of a rig file: immutable, no unknown keys, no text for numbers, no NaN or inf."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class AmplifierSettings(Section):
    """The high-voltage amplifier between the card's output and the electrodes."""

    model: str = Field(default="TREK 10/40A-HS", description="as it stands on the front panel")
    serial: str = Field(default="", description="serial number, kept with every recording")
    gain_V_per_V: float = Field(
        default=1000.0, ge=1.0, le=1e5, description="volts at the film per volt at the input"
    )
    offset_V: float = Field(
        default=0.0,
        ge=-100.0,
        le=100.0,
        description="measured output at 0 V input; commands are corrected for it",
    )
    range_kV: float = Field(
        default=10.0, gt=0.0, le=100.0, description="output range, plus and minus"
    )
    current_limit_mA: float = Field(
        default=40.0, gt=0.0, le=1000.0, description="output current limit"
    )
    monitor_V_per_kV: float = Field(
        default=1.0, gt=0.0, le=100.0, description="voltage monitor: volts per kilovolt at the film"
    )
    current_monitor_V_per_mA: float = Field(
        default=0.25, gt=0.0, le=100.0, description="current monitor: volts per milliampere"
    )
    slew_V_per_us: float = Field(
        default=900.0, gt=0.0, le=1e5, description="slew rate without load"
    )
    bandwidth_kHz: float = Field(
        default=25.0,
        ge=0.1,
        le=1e4,
        description="small-signal bandwidth (-3 dB), taken as first order",
    )
    monitor_noise_mV: float = Field(
        default=1.0, ge=0.0, le=100.0, description="simulated rig only: RMS noise of either monitor"
    )


class LaserSettings(Section):
    """The laser displacement sensor below the load, with its controller's analog output."""

    model: str = Field(
        default="Keyence LK-H152 / LK-G5000", description="sensor head and controller"
    )
    serial: str = Field(default="", description="serial number, kept with every recording")
    reference_distance_mm: float = Field(
        default=150.0, gt=0.0, le=5000.0, description="distance at which the analog output is 0 V"
    )
    range_mm: float = Field(
        default=40.0,
        gt=0.0,
        le=2000.0,
        description="measuring range, plus and minus, about the reference",
    )
    analog_range_V: float = Field(
        default=10.0, gt=0.0, le=10.0, description="analog output, plus and minus"
    )
    mm_per_V: float = Field(
        default=4.0, gt=0.0, le=1000.0, description="analog scaling set in controller"
    )
    direction: Literal[1, -1] = Field(
        default=1,
        description="1 when the analog output rises as the film gets longer, -1 when it falls",
    )
    sampling_us: float = Field(default=20.0, ge=2.55, le=1000.0, description="sampling period")
    averaging: int = Field(
        default=16, ge=1, le=262144, description="samples in the moving average: a power of 4"
    )
    port: str = Field(
        default="",
        description="serial port of the controller, such as COM3 or /dev/ttyUSB0; left empty, its "
        "settings are not compared with the ones here",
    )
    baud_rate: Literal[9600, 19200, 38400, 57600, 115200] = Field(
        default=115200, description="of the serial port"
    )
    output: Literal[1, 2] = Field(default=1, description="OUT of the controller: which head")
    resolution_um: float = Field(
        default=0.01, ge=0.0, le=100.0, description="simulated rig only: smallest step of a reading"
    )
    noise_um: float = Field(
        default=1.0,
        ge=0.0,
        le=1000.0,
        description="simulated rig only: RMS noise of a reading, with the averaging set here",
    )
    rest_position_mm: float = Field(
        default=6.4,
        ge=-2000.0,
        le=2000.0,
        description="simulated rig only: reading with the film at rest under its load",
    )
    clock_error_ppm: float = Field(
        default=20.0,
        ge=-1000.0,
        le=1000.0,
        description="simulated rig only: how slow its sampling clock is against the card's",
    )

    @field_validator("averaging")
    @classmethod
    def _power_of_four(cls, value: int) -> int:
        if value.bit_count() != 1 or value.bit_length() % 2 != 1:
            offered = ", ".join(str(4**i) for i in range(10))
            raise ValueError(f"the controller offers {offered}")
        return value

    @property
    def window(self) -> float:
        """Length of the moving average in s."""
        return self.averaging * self.sampling_us * 1e-6

    @property
    def delay(self) -> float:
        """Mean age of a reading in s.

        The average lags by (averaging - 1)/2 sampling periods, and the output stands for one
        period, half of which has passed on average.
        """
        return 0.5 * self.window

    @property
    def delay_error(self) -> float:
        """Time in s by which a reading may be older, or younger: its clock is not the card's."""
        return 0.5 * self.sampling_us * 1e-6


class CardSettings(Section):
    """The multifunction card: one output clock, on whose ticks the inputs are converted too."""

    model: str = Field(default="NI PCIe-6361", description="type of card")
    device: str = Field(default="Dev1", min_length=1, description="name in NI MAX")
    sample_rate_Hz: float = Field(
        default=1000.0, ge=1.0, le=1e6, description="rate of output and inputs"
    )
    bits: Literal[16] = Field(
        default=16, description="resolution of all converters; only 16 is supported"
    )
    ao_command: AnalogOutput = Field(default="ao0", description="output to the amplifier")
    ao_range_V: float = Field(
        default=10.0, ge=1.0, le=10.0, description="output range, plus and minus"
    )
    ai_voltage_monitor: AnalogInput = Field(default="ai0", description="from the voltage monitor")
    ai_current_monitor: AnalogInput = Field(default="ai1", description="from the current monitor")
    ai_displacement: AnalogInput = Field(default="ai2", description="from the laser controller")
    ai_temperature: AnalogInput = Field(
        default="ai3", description="from the thermometer, if there is one"
    )
    range_voltage_monitor_V: InputRange = Field(
        default=10.0, description="input range, plus and minus"
    )
    range_current_monitor_V: InputRange = Field(
        default=10.0, description="input range, plus and minus"
    )
    range_displacement_V: InputRange = Field(
        default=10.0, description="input range, plus and minus"
    )
    range_temperature_V: InputRange = Field(default=10.0, description="input range, plus and minus")
    terminals_voltage_monitor: Terminals = Field(
        default="DIFF", description="how the input is wired: differential, (non-)referenced single"
    )
    terminals_current_monitor: Terminals = Field(default="DIFF", description="as above")
    terminals_displacement: Terminals = Field(default="DIFF", description="as above")
    terminals_temperature: Terminals = Field(default="DIFF", description="as above")
    do_hv_enable: DigitalLine | None = Field(
        default=None,
        description="line that enables the amplifier's high voltage, such as port0/line0; left "
        "out, it is not wired",
    )
    hv_enable_watchdog_s: float = Field(
        default=0.0,
        ge=0.0,
        le=60.0,
        description="the card's own watchdog takes do_hv_enable low when the program is silent for "
        "so long; 0 means none",
    )
    first_convert_us: float = Field(
        default=50.0,
        ge=0.0,
        le=1e5,
        description="from the tick to the first conversion: lets the amplifier follow first",
    )
    convert_interval_us: float = Field(
        default=10.0, ge=0.5, le=1e5, description="from one input's conversion to the next one's"
    )
    ai_buffer_samples: int = Field(
        default=100_000,
        ge=1000,
        le=100_000_000,
        description="samples a channel kept for a late reader, at least; a card keeps four times "
        "interlocks.late_s",
    )
    ao_fifo_samples: int = Field(
        default=8191, ge=1, le=100_000_000, description="output FIFO of the card"
    )
    ao_buffer_s: float = Field(
        default=4.0,
        ge=0.5,
        le=60.0,
        description="a waveform longer than this is streamed, and written so far ahead",
    )
    ao_rate_max_kHz: float = Field(
        default=2860.0, gt=0.0, le=1e5, description="fastest output, one channel"
    )
    ai_rate_max_kHz: float = Field(
        default=1000.0, gt=0.0, le=1e5, description="fastest conversion over several channels"
    )
    timebase_MHz: float = Field(
        default=100.0,
        gt=0.0,
        le=1000.0,
        description="clock that is divided down to the sample rate",
    )
    calibration_ppm: float = Field(
        default=300.0,
        ge=0.0,
        le=1000.0,
        description="simulated rig only: spread of the inputs' calibration, of the range",
    )


class ThermometerSettings(Section):
    """An optional thermometer with a voltage output, near the film."""

    model: str = Field(default="Pt100 transmitter", description="type of thermometer")
    serial: str = Field(default="", description="serial number, kept with every recording")
    celsius_per_V: float = Field(default=10.0, gt=0.0, le=1000.0, description="scaling")
    celsius_at_0_V: float = Field(
        default=0.0, ge=-273.15, le=1000.0, description="temperature at 0 V"
    )
    room_celsius: float = Field(
        default=22.0, ge=-50.0, le=200.0, description="simulated rig only: temperature of the room"
    )
    noise_mK: float = Field(
        default=10.0, ge=0.0, le=1e5, description="simulated rig only: RMS noise"
    )


class LimitsSettings(Section):
    """What the film and the amplifier may see; the gate holds every sample against these."""

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
        default=1.0, gt=0.0, le=100.0, description="what counts as standing at voltage"
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
        description="the voltage monitor must read less than this once the rig is safe",
    )

    def gate_limits(self, film: str = "") -> Limits:
        """The limits as the gate takes them, in SI units, for the film of that name."""
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
    """What ends a run while it goes on: thresholds, how long each must be broken, what is done."""

    monitor_tolerance_kV: float = Field(
        default=1.5,
        gt=0.0,
        le=100.0,
        description="voltage monitor against command; an amplifier that loses 15 % at 8 kV passes",
    )
    monitor_debounce_ms: float = Field(default=50.0, ge=0.0, le=1e4, description="for so long")
    monitor_action: Action = Field(default="ramp", description="what is done")
    breakdown_fraction: float = Field(
        default=0.4,
        ge=0.0,
        le=1.0,
        description="a monitor below this part of a command above breakdown_above_kV is a "
        "breakdown, or an amplifier that tripped; 0 switches it off",
    )
    breakdown_above_kV: float = Field(default=0.5, gt=0.0, le=100.0, description="see above")
    breakdown_debounce_ms: float = Field(default=2.0, ge=0.0, le=1e4, description="for so long")
    breakdown_action: Action = Field(default="at once", description="what is done")
    current_max_mA: float = Field(
        default=20.0, gt=0.0, le=1000.0, description="current monitor, either sign"
    )
    current_debounce_ms: float = Field(default=2.0, ge=0.0, le=1e4, description="for so long")
    current_action: Action = Field(default="at once", description="what is done")
    laser_debounce_ms: float = Field(
        default=50.0, ge=0.0, le=1e4, description="reading out of the laser's range for so long"
    )
    laser_stuck_s: float = Field(
        default=0.5,
        ge=0.0,
        le=1e4,
        description="reading that does not change by one count for so long while the command "
        "moves by laser_stuck_swing_kV; 0 switches it off",
    )
    laser_stuck_swing_kV: float = Field(default=1.0, gt=0.0, le=100.0, description="see above")
    laser_action: Action = Field(default="ramp", description="what is done")
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
        default=5.0, ge=0.0, le=1e4, description="out of bounds for so long; a jump counts at once"
    )
    displacement_action: Action = Field(default="ramp", description="what is done")
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
        description="for so long, not counting the time between such displacements",
    )
    following_action: Action = Field(default="ramp", description="what is done")
    late_s: float = Field(
        default=1.0, gt=0.0, le=60.0, description="samples that wait for so long for the program"
    )
    late_action: Action = Field(default="ramp", description="what is done")
    disk_free_min_MB: float = Field(
        default=100.0, ge=0.0, le=1e6, description="room on the disk that must stay free"
    )
    disk_action: Action = Field(default="ramp", description="what is done")


class GuardianSettings(Section):
    """The process beside a run on real instruments that takes over when the run dies or freezes."""

    timeout_s: float = Field(
        default=1.0,
        ge=0.3,
        le=10.0,
        description="a run that is silent for so long is taken for frozen",
    )
    link_timeout_s: float = Field(
        default=2.0,
        ge=0.2,
        le=60.0,
        description="a server that does not answer for so long is taken for gone",
    )


class RigSettings(Section):
    """All instruments of a rig with its limits, which agree with each other."""

    amplifier: AmplifierSettings = AmplifierSettings()
    laser: LaserSettings = LaserSettings()
    card: CardSettings = CardSettings()
    thermometer: ThermometerSettings | None = Field(
        default=None, description="leave the table out when there is none"
    )
    limits: LimitsSettings = LimitsSettings()
    interlocks: InterlockSettings = InterlockSettings()
    guardian: GuardianSettings = GuardianSettings()

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the channels this rig delivers, in the order in which blocks hold them."""
        return tuple(
            name for name in CHANNEL_NAMES if name != "temperature" or self.thermometer is not None
        )

    def channels(
        self,
        coefficients: Mapping[str, tuple[float, ...]],
        skews: Sequence[float] | None = None,
    ) -> tuple[Channel, ...]:
        """The rig's channels in the order of blocks.

        ``coefficients`` maps each of ``channel_names`` to the scaling polynomial of its converter,
        V over counts, lowest power first. ``skews`` in s are those that a card really has, input by
        input, where it did not take exactly the ones asked for.
        """
        if skews is None:
            skews = [self.skew(place) for place in range(len(self.channel_names) - 1)]
        amplifier, laser = self.amplifier, self.laser
        units = {
            "voltage_command": ("V", amplifier.gain_V_per_V, amplifier.offset_V),
            "voltage_monitor": ("V", 1e3 / amplifier.monitor_V_per_kV, 0.0),
            "current_monitor": ("A", 1e-3 / amplifier.current_monitor_V_per_mA, 0.0),
            "displacement": ("m", laser.direction * laser.mm_per_V * 1e-3, 0.0),
        }
        if self.thermometer is not None:
            zero = self.thermometer.celsius_at_0_V + _ZERO_CELSIUS
            units["temperature"] = ("K", self.thermometer.celsius_per_V, zero)
        channels = []
        for place, name in enumerate(self.channel_names):
            unit, gain, offset = units[name]
            channels.append(
                Channel(
                    name=name,
                    unit=unit,
                    scaling=Scaling(tuple(coefficients[name]), gain, offset),
                    # the command is put out on the tick itself; the inputs follow one by one
                    skew=skews[place - 1] if place else 0.0,
                    delay=laser.delay if name == "displacement" else 0.0,
                    delay_error=laser.delay_error if name == "displacement" else 0.0,
                )
            )
        return tuple(channels)

    def skew(self, place: int) -> float:
        """Time in s from the tick to the conversion of the input in ``place`` 0, 1, ..."""
        return (self.card.first_convert_us + place * self.card.convert_interval_us) * 1e-6

    def terminals(self) -> dict[str, str]:
        """Card terminal of each channel: ``{"voltage_command": "ao0", ...}``."""
        card = self.card
        wired = {
            "voltage_command": card.ao_command,
            "voltage_monitor": card.ai_voltage_monitor,
            "current_monitor": card.ai_current_monitor,
            "displacement": card.ai_displacement,
            "temperature": card.ai_temperature,
        }
        return {name: wired[name] for name in self.channel_names}

    def ranges(self) -> dict[str, float]:
        """Converter range of each channel in V, plus and minus."""
        card = self.card
        ranges = {
            "voltage_command": card.ao_range_V,
            "voltage_monitor": card.range_voltage_monitor_V,
            "current_monitor": card.range_current_monitor_V,
            "displacement": card.range_displacement_V,
            "temperature": card.range_temperature_V,
        }
        return {name: ranges[name] for name in self.channel_names}

    def wiring(self) -> dict[str, str]:
        """Terminal configuration of each input channel: ``{"voltage_monitor": "DIFF", ...}``."""
        card = self.card
        wiring = {
            "voltage_monitor": card.terminals_voltage_monitor,
            "current_monitor": card.terminals_current_monitor,
            "displacement": card.terminals_displacement,
            "temperature": card.terminals_temperature,
        }
        return {name: wiring[name] for name in self.channel_names if name in wiring}

    @model_validator(mode="after")
    def _instruments_agree(self) -> RigSettings:
        amplifier, laser, card, limits = self.amplifier, self.laser, self.card, self.limits

        def most(key: str, value: float, allowed: float, why: str) -> None:
            # a hair of tolerance: products of decimal fractions are not exact
            if value > allowed * (1.0 + 1e-9):
                raise ValueError(f"{key} = {value:g} is more than {allowed:g}: {why}")

        most(
            "limits.voltage_max_kV",
            limits.voltage_max_kV,
            amplifier.range_kV,
            "the amplifier's range",
        )
        most(
            "limits.voltage_min_kV, without its sign,",
            -limits.voltage_min_kV,
            amplifier.range_kV,
            "the amplifier's range",
        )
        most(
            "limits.slew_max_kV_per_s",
            limits.slew_max_kV_per_s,
            amplifier.slew_V_per_us * 1e3,
            "the amplifier's own slew rate",
        )
        highest = max(limits.voltage_max_kV, -limits.voltage_min_kV)
        most(
            "limits.voltage_max_kV",
            highest,
            (card.ao_range_V * amplifier.gain_V_per_V - abs(amplifier.offset_V)) * 1e-3,
            "what card.ao_range_V times amplifier.gain_V_per_V reaches",
        )
        most(
            "limits.voltage_max_kV",
            highest,
            card.range_voltage_monitor_V / amplifier.monitor_V_per_kV,
            "what card.range_voltage_monitor_V can read of the voltage monitor",
        )
        most(
            "laser.range_mm",
            laser.range_mm,
            laser.mm_per_V * min(laser.analog_range_V, card.range_displacement_V),
            "what laser.mm_per_V leaves within laser.analog_range_V and card.range_displacement_V",
        )
        most(
            "laser.rest_position_mm, without its sign,",
            abs(laser.rest_position_mm),
            laser.range_mm,
            "the laser's range",
        )
        inputs = [t for name, t in self.terminals().items() if name != "voltage_command"]
        for terminal in inputs:
            if inputs.count(terminal) > 1:
                raise ValueError(f"card: input {terminal} is wired to two channels, one is allowed")
        if self.interlocks.current_max_mA >= amplifier.current_limit_mA:
            raise ValueError(
                f"interlocks.current_max_mA = {self.interlocks.current_max_mA:g} is not below "
                f"amplifier.current_limit_mA = {amplifier.current_limit_mA:g}: the amplifier would "
                f"never deliver what trips it"
            )
        for name, how in self.wiring().items():
            number = int(self.terminals()[name].removeprefix("ai"))
            if how == "DIFF" and number % 16 >= 8:
                raise ValueError(
                    f'card.ai_{name} = "ai{number}" with card.terminals_{name} = "DIFF": '
                    f"differential inputs are ai0 to ai7, whose other wire is 8 higher"
                )
        if card.hv_enable_watchdog_s > 0.0 and card.do_hv_enable is None:
            raise ValueError(
                "card.hv_enable_watchdog_s is set, but no card.do_hv_enable that it could take low"
            )
        most(
            "card.first_convert_us and card.convert_interval_us: the scan, in us,",
            self.skew(len(inputs) - 1) * 1e6 + card.convert_interval_us,
            1e6 / card.sample_rate_Hz,
            "one sample interval at card.sample_rate_Hz",
        )
        most(
            "card.sample_rate_Hz",
            card.sample_rate_Hz,
            min(card.ao_rate_max_kHz, card.ai_rate_max_kHz / len(inputs)) * 1e3,
            "what the card can do on this many channels",
        )
        most(
            "1 / card.convert_interval_us, in kHz,",
            1e3 / card.convert_interval_us,
            card.ai_rate_max_kHz,
            "card.ai_rate_max_kHz",
        )
        return self
