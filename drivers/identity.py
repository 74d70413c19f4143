"""Descriptions of a rig's instruments, kept with every recording."""

from __future__ import annotations

from dearig.drivers.rig import Instrument
from dearig.drivers.settings import RigSettings

__all__ = ["instruments"]


def instruments(
    settings: RigSettings, *, card_model: str, card_serial: str, unnamed: str
) -> tuple[Instrument, ...]:
    """Return the rig's instruments; ``unnamed`` stands for a serial number that is not known.

    The card reports its own model and serial number; those of the others come from the rig file.
    """
    amplifier, laser, card = settings.amplifier, settings.laser, settings.card
    averaging = []
    if card.average > 1:
        averaging = [
            ("averaging", f"{card.average} conversions a row"),
            ("conversion rate", f"{card.conversion_rate_Hz:g} Hz"),
        ]
    found = [
        Instrument(
            "card",
            card_model,
            card_serial,
            (
                ("device", card.device),
                *((f"terminal of {n}", t) for n, t in settings.terminals().items()),
                *((f"range of {n}", f"+-{r:g} V") for n, r in settings.ranges().items()),
                *((f"wiring of {n}", w) for n, w in settings.wiring().items()),
                ("first conversion", f"{card.first_convert_us:g} us after the tick"),
                ("conversion interval", f"{card.convert_interval_us:g} us"),
                *averaging,
                ("high-voltage enable", card.do_hv_enable or "not wired"),
            ),
        ),
        Instrument(
            "amplifier",
            amplifier.model,
            amplifier.serial or unnamed,
            (
                ("gain", f"{amplifier.gain_V_per_V:g} V/V"),
                ("range", f"+-{amplifier.range_kV:g} kV"),
                ("current limit", f"{amplifier.current_limit_mA:g} mA"),
                ("slew rate", f"{amplifier.slew_V_per_us:g} V/us"),
                ("bandwidth", f"{amplifier.bandwidth_kHz:g} kHz"),
                ("voltage monitor", f"{amplifier.monitor_V_per_kV:g} V/kV"),
                ("current monitor", f"{amplifier.current_monitor_V_per_mA:g} V/mA"),
            ),
        ),
        Instrument(
            "laser",
            laser.model,
            laser.serial or unnamed,
            (
                ("reference distance", f"{laser.reference_distance_mm:g} mm"),
                ("range", f"+-{laser.range_mm:g} mm"),
                ("analog scaling", f"{laser.mm_per_V:g} mm/V"),
                ("sampling", f"{laser.sampling_us:g} us"),
                ("averaging", f"{laser.averaging} samples"),
            ),
        ),
    ]
    if settings.thermometer is not None:
        thermometer = settings.thermometer
        found.append(
            Instrument(
                "thermometer",
                thermometer.model,
                thermometer.serial or unnamed,
                (("scaling", f"{thermometer.celsius_per_V:g} C/V"),),
            )
        )
    if settings.thermohygrometer is not None:
        sensor = settings.thermohygrometer
        found.append(
            Instrument(
                "thermohygrometer",
                sensor.model,
                sensor.serial or unnamed,
                (
                    ("port", sensor.port or "none"),
                    ("interval", f"{sensor.interval_s:g} s"),
                    ("too old after", f"{sensor.stale_s:g} s"),
                ),
            )
        )
    return tuple(found)
