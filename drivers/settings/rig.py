"""Settings of all instruments of a rig, with its channels and consistency checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pydantic import Field, model_validator

from dearig.drivers.channels import CHANNEL_NAMES, Channel, Scaling
from dearig.drivers.settings.amplifier import AmplifierSettings
from dearig.drivers.settings.card import CardSettings
from dearig.drivers.settings.channel import ChannelSettings, ThermometerSettings
from dearig.drivers.settings.laser import LaserSettings
from dearig.drivers.settings.limits import GuardianSettings, InterlockSettings, LimitsSettings
from dearig.drivers.settings.room import RoomSettings, ThermohygrometerSettings
from dearig.drivers.settings.section import Section

__all__ = ["RigSettings"]

_ZERO_CELSIUS = 273.15  # K


def _require_at_most(key: str, value: float, allowed: float, why: str) -> None:
    # with a small tolerance: products of decimal fractions are not exact
    if value > allowed * (1.0 + 1e-9):
        raise ValueError(f"{key} = {value:g} is more than {allowed:g}: {why}")


class RigSettings(Section):
    """Settings of a rig's instruments and limits, checked for consistency."""

    amplifier: AmplifierSettings = AmplifierSettings()
    laser: LaserSettings = LaserSettings()
    card: CardSettings = CardSettings()
    thermometer: ThermometerSettings | None = Field(
        default=None, description="leave the table out when there is none"
    )
    thermohygrometer: ThermohygrometerSettings | None = Field(
        default=None, description="leave the table out when there is none"
    )
    channel: tuple[ChannelSettings, ...] = Field(
        default=(),
        strict=False,  # TOML has lists, not tuples; their items are validated strictly
        description="one [[channel]] table for each",
    )
    limits: LimitsSettings = LimitsSettings()
    interlocks: InterlockSettings = InterlockSettings()
    guardian: GuardianSettings = GuardianSettings()
    room: RoomSettings = RoomSettings()

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Return the names of this rig's channels in the order of a block's rows."""
        return (
            *(n for n in CHANNEL_NAMES if n != "temperature" or self.thermometer is not None),
            *(channel.name for channel in self.channel),
        )

    def channels(
        self,
        coefficients: Mapping[str, tuple[float, ...]],
        skews: Sequence[float] | None = None,
    ) -> tuple[Channel, ...]:
        """Return the rig's channels in the order of a block's rows.

        ``coefficients`` maps each of ``channel_names`` to the scaling polynomial of its converter,
        V over counts, lowest power first. ``skews`` in s are the card's actual ones by input,
        where they differ from the requested ones.
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
        declared = {channel.name: channel for channel in self.channel}
        for name, channel in declared.items():
            units[name] = (channel.unit, channel.unit_per_V, channel.value_at_0_V)
        delays = {"displacement": laser.delay}
        delays |= {name: channel.delay_ms * 1e-3 for name, channel in declared.items()}
        channels = []
        for place, name in enumerate(self.channel_names):
            unit, gain, offset = units[name]
            channels.append(
                Channel(
                    name=name,
                    unit=unit,
                    scaling=Scaling(tuple(coefficients[name]), gain, offset),
                    # the command is output on the tick itself; the inputs follow one by one
                    skew=skews[place - 1] if place else 0.0,
                    delay=delays.get(name, 0.0),
                    delay_error=laser.delay_error if name == "displacement" else 0.0,
                    label=declared[name].label if name in declared else "",
                )
            )
        return tuple(channels)

    def skew(self, place: int) -> float:
        """Return the time in s from the tick to the conversion of input number ``place``."""
        return (self.card.first_convert_us + place * self.card.convert_interval_us) * 1e-6

    def terminals(self) -> dict[str, str]:
        """Return the card terminal of each channel: ``{"voltage_command": "ao0", ...}``."""
        card = self.card
        wired = {
            "voltage_command": card.ao_command,
            "voltage_monitor": card.ai_voltage_monitor,
            "current_monitor": card.ai_current_monitor,
            "displacement": card.ai_displacement,
            "temperature": card.ai_temperature,
            **{channel.name: channel.terminal for channel in self.channel},
        }
        return {name: wired[name] for name in self.channel_names}

    def ranges(self) -> dict[str, float]:
        """Return the converter range of each channel in V, plus and minus."""
        card = self.card
        ranges = {
            "voltage_command": card.ao_range_V,
            "voltage_monitor": card.range_voltage_monitor_V,
            "current_monitor": card.range_current_monitor_V,
            "displacement": card.range_displacement_V,
            "temperature": card.range_temperature_V,
            **{channel.name: channel.range_V for channel in self.channel},
        }
        return {name: ranges[name] for name in self.channel_names}

    def wiring(self) -> dict[str, str]:
        """Return the terminal configuration of each input: ``{"voltage_monitor": "DIFF", ...}``."""
        card = self.card
        wiring = {
            "voltage_monitor": card.terminals_voltage_monitor,
            "current_monitor": card.terminals_current_monitor,
            "displacement": card.terminals_displacement,
            "temperature": card.terminals_temperature,
            **{channel.name: channel.wiring for channel in self.channel},
        }
        return {name: wiring[name] for name in self.channel_names if name in wiring}

    def keys(self, name: str) -> tuple[str, str, str]:
        """Return the keys of a rig file that give a channel its terminal, range and wiring."""
        if name in (channel.name for channel in self.channel):
            where = f"channel {name}: "
            return where + "terminal", where + "range_V", where + "wiring"
        if name == "voltage_command":
            return "card.ao_command", "card.ao_range_V", ""
        return f"card.ai_{name}", f"card.range_{name}_V", f"card.terminals_{name}"

    @model_validator(mode="after")
    def _instruments_agree(self) -> RigSettings:
        amplifier, laser, card, limits = self.amplifier, self.laser, self.card, self.limits

        _require_at_most(
            "limits.voltage_max_kV",
            limits.voltage_max_kV,
            amplifier.range_kV,
            "the amplifier's range",
        )
        _require_at_most(
            "limits.voltage_min_kV, without its sign,",
            -limits.voltage_min_kV,
            amplifier.range_kV,
            "the amplifier's range",
        )
        _require_at_most(
            "limits.slew_max_kV_per_s",
            limits.slew_max_kV_per_s,
            amplifier.slew_V_per_us * 1e3,
            "the amplifier's own slew rate",
        )
        highest = max(limits.voltage_max_kV, -limits.voltage_min_kV)
        _require_at_most(
            "limits.voltage_max_kV",
            highest,
            (card.ao_range_V * amplifier.gain_V_per_V - abs(amplifier.offset_V)) * 1e-3,
            "what card.ao_range_V times amplifier.gain_V_per_V reaches",
        )
        _require_at_most(
            "limits.voltage_max_kV",
            highest,
            card.range_voltage_monitor_V / amplifier.monitor_V_per_kV,
            "what card.range_voltage_monitor_V can read of the voltage monitor",
        )
        _require_at_most(
            "laser.range_mm",
            laser.range_mm,
            laser.mm_per_V * min(laser.analog_range_V, card.range_displacement_V),
            "what laser.mm_per_V leaves within laser.analog_range_V and card.range_displacement_V",
        )
        _require_at_most(
            "laser.rest_position_mm, without its sign,",
            abs(laser.rest_position_mm),
            laser.range_mm,
            "the laser's range",
        )
        self._check_wiring()
        self._check_sampling()
        return self

    def _check_wiring(self) -> None:
        amplifier = self.amplifier
        names = self.channel_names
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"channel {name}: the name is given to two channels")
        inputs = self._input_terminals()
        for terminal in inputs:
            if inputs.count(terminal) > 1:
                raise ValueError(f"card: input {terminal} is wired to two channels, one is allowed")
        if self.interlocks.current_max_mA >= amplifier.current_limit_mA:
            raise ValueError(
                f"interlocks.current_max_mA = {self.interlocks.current_max_mA:g} is not below "
                f"amplifier.current_limit_mA = {amplifier.current_limit_mA:g}: the amplifier "
                f"limits the current before the interlock can trip"
            )
        for name, how in self.wiring().items():
            number = int(self.terminals()[name].removeprefix("ai"))
            if how == "DIFF" and number % 16 >= 8:
                terminal, _, wiring = self.keys(name)
                raise ValueError(
                    f'{terminal} = "ai{number}" with {wiring} = "DIFF": differential inputs are '
                    f"ai0 to ai7; the second wire is the input 8 higher"
                )

    def _check_sampling(self) -> None:
        card = self.card
        inputs = self._input_terminals()
        rate = "card.sample_rate_Hz"
        if card.average > 1:
            rate = f"card.sample_rate_Hz x card.average ({card.sample_rate_Hz:g} x {card.average})"
        _require_at_most(
            "card.first_convert_us and card.convert_interval_us: the scan, in us,",
            self.skew(len(inputs) - 1) * 1e6 + card.convert_interval_us,
            1e6 / card.conversion_rate_Hz,
            f"one sample interval at {rate}",
        )
        _require_at_most(
            rate,
            card.conversion_rate_Hz,
            min(card.ao_rate_max_kHz, card.ai_rate_max_kHz / len(inputs)) * 1e3,
            "what the card can do on this many channels",
        )
        _require_at_most(
            "1 / card.convert_interval_us, in kHz,",
            1e3 / card.convert_interval_us,
            card.ai_rate_max_kHz,
            "card.ai_rate_max_kHz",
        )

    def _input_terminals(self) -> list[str]:
        return [t for name, t in self.terminals().items() if name != "voltage_command"]
