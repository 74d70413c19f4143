"""Inspection of the card and of the instruments wired to it, without any output voltage."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from dearig.drivers.daqmx.explain import instrument_errors
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import Outputs
from dearig.drivers.daqmx.tasks import ClockedTasks
from dearig.drivers.daqmx.watchdog import watchdog_finding
from dearig.drivers.errors import LinkRefused, RigError
from dearig.drivers.instruments.amplifier import Monitors
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import RigSettings

__all__ = ["Inspection", "inspect"]


@dataclass(frozen=True)
class Inspection:
    """Findings on the card, and readings of its inputs, None where they could not be read.

    ``displacement_volts`` is the laser's analog output; ``readings`` are those of the channels
    that the rig file declares, by name, in their units.
    """

    findings: tuple[Finding, ...]
    monitors: Monitors | None = None
    displacement_volts: float | None = None
    readings: dict[str, float] = field(default_factory=dict)


def inspect(device: str, server: str | None, settings: RigSettings) -> Inspection:
    """Inspect the card ``device``, in this computer or behind ``server``, against ``settings``.

    A card that cannot be reached is a finding. Raises ``LinkRefused`` for a connection that the
    rig file does not allow.
    """
    name = f"card {device}"
    unreached = watchdog_finding(name, settings.card, None, server)
    try:
        link = Link(server, settings)
    except LinkRefused:
        raise
    except RigError as error:
        return Inspection((Finding(name, "driver", str(error), verdict="wrong"), unreached))
    findings: list[Finding] = []
    reached = False
    outputs = Outputs(link, device, settings)
    try:
        with instrument_errors(device, server):
            from nidaqmx.system import Device, System

            system = System(link.session) if server else System.local()
            version = system.driver_version
            findings.append(
                Finding(
                    name, "driver",
                    f"NI-DAQmx {version.major_version}.{version.minor_version}"
                    f".{version.update_version}" + (f" behind {server}" if server else ""),
                )
            )  # fmt: skip
            if link.security:
                findings.append(link.security)
            card = Device(device, grpc_options=link.session)
            watchdog = watchdog_finding(name, settings.card, bool(card.is_simulated), server)
            findings += _card(name, card, settings)
            findings.append(watchdog)
            reached = True
        if any(finding.verdict == "wrong" for finding in findings):
            return Inspection(tuple(findings))
        findings.append(_timing(name, link, device, settings))
        monitors = Monitors.of_volts(
            settings.amplifier, outputs.read("voltage_monitor"), outputs.read("current_monitor")
        )
        displacement = outputs.read("displacement")
        readings = {c.name: c.value(outputs.read(c.name)) for c in settings.channel}
        return Inspection(tuple(findings), monitors, displacement, readings)
    except RigError as error:
        said = str(error).removeprefix(f"{name}: ")
        findings.append(Finding(name, "state", said, verdict="wrong"))
        if not reached:
            findings.append(unreached)
        return Inspection(tuple(findings))
    finally:
        outputs.close()
        link.close()


def _card(name: str, card: Any, settings: RigSettings) -> list[Finding]:
    """Compare the card's own report with what the rig file needs."""
    wanted = settings.card
    model = card.product_type
    same = model.split()[-1] == wanted.model.split()[-1]
    found = [
        Finding(
            name, "type",
            f"{model}, serial {card.serial_num:X}" + (", simulated" if card.is_simulated else ""),
            wanted.model, "ok" if same else "wrong",
            "" if same else "correct card.model, and compare every range in [card] with the manual",
        )
    ]  # fmt: skip
    outputs = [terminal.split("/")[-1] for terminal in card.ao_physical_chans.channel_names]
    inputs = [terminal.split("/")[-1] for terminal in card.ai_physical_chans.channel_names]
    lines = ["/".join(line.split("/")[-2:]) for line in card.do_lines.channel_names]
    for channel, terminal in settings.terminals().items():
        there = outputs if channel == "voltage_command" else inputs
        key = settings.keys(channel)[0]
        found.append(_has(name, f"{key} = {terminal}", terminal in there, "the card's terminals"))
    for channel, limit in settings.ranges().items():
        pairs = card.ao_voltage_rngs if channel == "voltage_command" else card.ai_voltage_rngs
        offered = sorted({high for low, high in zip(pairs[::2], pairs[1::2], strict=True)})
        key = settings.keys(channel)[1]
        ranges = "one of " + ", ".join(f"{high:g}" for high in offered)
        found.append(_has(name, f"{key} = {limit:g}", limit in offered, ranges))
    if wanted.do_hv_enable is None:
        found.append(
            Finding(
                name, "card.do_hv_enable", "not wired", verdict="not wired",
                advice="with a line to the amplifier's enable input, the guardian and the card's "
                "watchdog can switch the high voltage off",
            )
        )  # fmt: skip
    else:
        key = f"card.do_hv_enable = {wanted.do_hv_enable}"
        found.append(_has(name, key, wanted.do_hv_enable in lines, "one of the card's lines"))
    fastest = min(card.ao_max_rate, card.ai_max_multi_chan_rate / (len(settings.terminals()) - 1))
    fast = wanted.conversion_rate_Hz <= fastest
    averages = wanted.average > 1
    found.append(
        Finding(
            name, "card.sample_rate_Hz" + (" x card.average" if averages else ""),
            f"{wanted.conversion_rate_Hz:g}", f"{fastest:g} or less", "ok" if fast else "wrong",
            "" if fast else "lower one of them" if averages else "lower it",
        )
    )  # fmt: skip
    return found


def _has(name: str, item: str, there: bool, wanted: str) -> Finding:
    return Finding(
        name, item, "found" if there else "the card does not have it", wanted,
        "ok" if there else "wrong", "" if there else "correct the rig file",
    )  # fmt: skip


def _timing(name: str, link: Link, device: str, settings: RigSettings) -> Finding:
    """Reserve the card as a run does, which fails where it is in use; no output changes."""
    tasks = ClockedTasks(link, device, settings)
    try:
        skews = [channel.skew for channel in tasks.channels()[1:]]
    finally:
        tasks.close()
    asked = [settings.skew(place) for place in range(len(skews))]
    off = max(abs(one - other) for one, other in zip(skews, asked, strict=True))
    near = off < 1e-6
    return Finding(
        name, "conversion times",
        ", ".join(f"{skew * 1e6:.3g}" for skew in skews) + " us after the tick",
        ", ".join(f"{skew * 1e6:.3g}" for skew in asked),
        "ok" if near else "warning",
        "" if near else "recordings contain the card's actual times",
    )  # fmt: skip
