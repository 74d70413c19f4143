"""A look at a rig before it is used: what is there, what is wrong, which limits hold, at 0 V."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from itertools import groupby
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from dearig.config.rigfile import RigFile
from dearig.drivers.channels import Channel
from dearig.drivers.errors import AddressError, RigError
from dearig.drivers.findings import Finding
from dearig.drivers.gate import Prediction, admit
from dearig.drivers.keyence import LaserInspection, analog_findings
from dearig.drivers.keyence import inspect as inspect_laser
from dearig.drivers.rig import Rig, RigIdentity
from dearig.drivers.trek import Monitors, scaling_findings, zero_findings
from dearig.errors import InputError, InstrumentFault
from dearig.sim_backend.factory import is_simulated, open_simulated_rig
from dearig.sim_backend.faults import FaultKind, FaultPlan
from dearig.sim_backend.keyence import SimulatedController, SimulatedLine

__all__ = ["CheckOutcome", "check_json", "check_rig", "check_table"]

_SECONDS = 0.2  # of samples at 0 V
_SAMPLES_MIN = 16


@dataclass(frozen=True)
class CheckOutcome:
    """Everything that was looked at on the rig at address ``rig``."""

    rig: str
    simulated: bool
    findings: tuple[Finding, ...]

    @property
    def wrong(self) -> tuple[Finding, ...]:
        """What keeps a run from starting."""
        return tuple(f for f in self.findings if f.verdict == "wrong")

    def refuse(self) -> None:
        """Raise ``InstrumentFault`` with the first thing that keeps a run from starting, if any."""
        if self.wrong:
            more = f" (and {len(self.wrong) - 1} more)" if len(self.wrong) > 1 else ""
            raise InstrumentFault(f"{self.wrong[0].sentence}{more}")

    @property
    def summary(self) -> str:
        """All of it in one sentence."""
        counts = {
            "wrong": len(self.wrong),
            "to be looked at": sum(f.verdict == "warning" for f in self.findings),
            "not wired": sum(f.verdict == "not wired" for f in self.findings),
        }
        others = ", ".join(f"{n} {what}" for what, n in counts.items() if n)
        return f"{len(self.findings)} things looked at" + (
            f": {others}" if others else ", all well"
        )


def check_rig(rig: str, rig_file: RigFile, faults: FaultPlan | None = None) -> CheckOutcome:
    """Look at the instruments of the rig at address ``rig``, as ``rig_file`` wants them.

    A simulated rig plays 0 V and is read, and where ``laser.port`` is not empty a simulated
    controller is asked through the driver; ``faults`` go wrong in it. What is wrong with
    instruments is in the outcome. Raises ``InputError`` for an address that names no rig.
    """
    simulated = is_simulated(rig)
    if simulated:
        instruments = _simulated(rig, rig_file, faults or FaultPlan())
    elif rig.startswith("daqmx:"):
        instruments = _real(rig, rig_file)
    else:
        raise InputError(
            f"rig {rig!r} is not known: write sim, sim:SEED such as sim:7, daqmx:Dev1 or "
            f"daqmx:Dev1@HOST:PORT"
        )
    findings = (*_programs(), *instruments, *_limits(rig_file, simulated))
    return CheckOutcome(rig, simulated, findings)


# ---------------------------------------------------------------- a real rig


def _real(rig: str, rig_file: RigFile) -> tuple[Finding, ...]:
    # not everybody who simulates has what a card needs
    from dearig.drivers.daqmx import inspect
    from dearig.drivers.daqmx.address import Address

    try:
        address = Address.parse(rig)
    except AddressError as error:
        raise InputError(str(error)) from error
    card = inspect(address.device, address.server, rig_file)
    laser = inspect_laser(rig_file.laser)
    return (
        *card.findings,
        *_amplifier(rig_file, card.monitors),
        *_laser(rig_file, card.displacement_volts, laser),
    )


def _amplifier(rig_file: RigFile, monitors: Monitors | None) -> tuple[Finding, ...]:
    scaling = scaling_findings(rig_file)
    if monitors is not None:
        return (*scaling, *zero_findings(monitors, rig_file))
    unread = Finding(
        rig_file.amplifier.model, "monitors at 0 V", "not read", verdict="warning",
        advice="mend what is wrong with the card first",
    )  # fmt: skip
    return (*scaling, unread)


def _laser(
    rig_file: RigFile, volts: float | None, controller: LaserInspection
) -> tuple[Finding, ...]:
    if volts is not None:
        return (*controller.findings, *analog_findings(rig_file.laser, volts, controller))
    unread = Finding(
        rig_file.laser.model, "analog output", "not read", verdict="warning",
        advice="mend what is wrong with the card first",
    )  # fmt: skip
    return (*controller.findings, unread)


# ---------------------------------------------------------------- a simulated rig


def _simulated(rig: str, rig_file: RigFile, faults: FaultPlan) -> tuple[Finding, ...]:
    serial = faults.of(FaultKind.SERIAL_GARBAGE)
    others = FaultPlan(tuple(fault for fault in faults.faults if fault not in serial))
    try:
        opened = open_simulated_rig(
            rig, rig_file, rig_file.as_film(), rig_file.as_load(), faults=others
        )
    except AddressError as error:
        raise InputError(str(error)) from error
    except ValueError as error:  # a film that cannot hang at rest
        raise InputError(f"rig {rig!r} with this rig file: {error}") from error
    try:
        identity = opened.identify()
        rate, channels = _at_zero(opened, rig_file, identity.channels)
    except RigError as error:
        broken = Finding(rig_file.card.model, "samples at 0 V", str(error), verdict="wrong")
        return (broken, *_amplifier(rig_file, None), *_laser(rig_file, None, LaserInspection(())))
    finally:
        opened.close()
    monitors = Monitors(channels["voltage_monitor"], channels["current_monitor"])
    displacement, settings = channels["displacement"], rig_file.laser
    if settings.port:
        settings = settings.model_copy(update={"port": f"{settings.port} (simulated)"})
    controller = SimulatedController(
        settings, lambda _: displacement, faults=FaultPlan(tuple(serial))
    )
    line = SimulatedLine(controller, settings.baud_rate)
    laser = inspect_laser(settings, lambda _: line, line.now)
    volts = settings.direction * displacement * 1e3 / settings.mm_per_V
    return (
        *_simulated_card(rig_file, identity, rate),
        *_amplifier(rig_file, monitors),
        *_laser(rig_file, volts, laser),
    )


def _at_zero(
    rig: Rig, rig_file: RigFile, channels: tuple[Channel, ...]
) -> tuple[float, dict[str, float]]:
    """Sample rate in Hz, and means of ``channels`` in SI units, with 0 V at the output."""
    limits, film = rig_file.gate_limits(), rig_file.as_film()
    rate = float(rig_file.card.sample_rate_Hz)
    zero = np.zeros(max(_SAMPLES_MIN, round(_SECONDS * rate)))
    # at 0 V any film is well
    prediction = Prediction(
        np.full(zero.size, 1.0 / film.thickness), film.electric_volume, film=limits.film
    )
    rate = rig.load(admit(zero, rate, limits, prediction))
    rig.arm()
    rig.start()
    blocks = []
    while (block := rig.read()) is not None:
        blocks.append(block.counts)
    counts = np.concatenate(blocks, axis=1)
    return rate, {
        channel.name: float(np.mean(channel.scaling.physical(row)))
        for channel, row in zip(channels, counts, strict=True)
    }


def _simulated_card(rig_file: RigFile, identity: RigIdentity, rate: float) -> Iterator[Finding]:
    name = rig_file.card.model
    yield Finding(name, "type", f"simulated, at {identity.address}")
    yield Finding(name, "sample rate", f"{rate:.6g} Hz", f"{rig_file.card.sample_rate_Hz:g} Hz")
    ranges = rig_file.ranges()
    for channel, terminal in rig_file.terminals().items():
        yield Finding(name, channel.replace("_", " "), f"{terminal}, +-{ranges[channel]:g} V")
    if rig_file.card.do_hv_enable is None:
        yield Finding(name, "high-voltage enable", "no line in the rig file", verdict="not wired")


# ---------------------------------------------------------------- what holds for both


def _programs() -> Iterator[Finding]:
    found = [f"Python {platform.python_version()}"]
    for package in ("dearig", "nidaqmx", "pyserial"):
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            found.append(f"no {package}")
    yield Finding("programs", "versions", ", ".join(found))


def _limits(rig_file: RigFile, simulated: bool) -> Iterator[Finding]:
    limits, name = rig_file.limits, "limits"
    yield Finding(name, "voltage", f"{limits.voltage_min_kV:g} to {limits.voltage_max_kV:g} kV")
    yield Finding(name, "slew", f"{limits.slew_max_kV_per_s:g} kV/s")
    yield Finding(name, "true field", f"{limits.true_field_max_MV_per_m:g} MV/m")
    yield Finding(name, "energy", f"{limits.energy_max_J:g} J a run")
    yield Finding(
        name, "time at voltage",
        f"{limits.time_at_voltage_max_s:g} s at {limits.at_voltage_kV:g} kV or more",
    )  # fmt: skip
    if rig_file.film.name:
        yield Finding(name, "film", rig_file.film.name)
    elif simulated:
        yield Finding(name, "film", "any")
    else:
        yield Finding(
            name, "film", "none is named", "the film that hangs there", "wrong",
            "name it in [film] of the rig file: a run on real instruments needs it",
        )  # fmt: skip


# ---------------------------------------------------------------- to be shown

_LOOKS = {"ok": "green", "warning": "yellow", "wrong": "bold red", "not wired": "dim"}


def check_table(outcome: CheckOutcome) -> RenderableType:
    """The findings, instrument by instrument, and what to do about those that are not well."""
    pieces: list[RenderableType] = []
    for instrument, group in groupby(outcome.findings, key=lambda finding: finding.instrument):
        table = Table(
            title=Text(instrument, style="bold"), title_justify="left",
            show_header=False, box=None, pad_edge=False,
        )  # fmt: skip
        table.add_column(no_wrap=True, width=max(map(len, _LOOKS)))
        table.add_column(overflow="fold")
        for finding in group:
            words = f"{finding.item}: {finding.found}"
            if finding.verdict != "ok":
                wanted = f", {finding.wanted} is wanted" if finding.wanted else ""
                words += wanted + (f"; {finding.advice}" if finding.advice else "")
            table.add_row(Text(finding.verdict, style=_LOOKS[finding.verdict]), Text(words))
        pieces.append(table)
    return Group(*pieces, Text(f"{outcome.rig}: {outcome.summary}."))


def check_json(outcome: CheckOutcome) -> dict[str, Any]:
    """The outcome as it goes into a file."""
    return {
        "format": "dearig-check/1",
        "rig": outcome.rig,
        "simulated": outcome.simulated,
        "well": not outcome.wrong,
        "findings": [asdict(finding) for finding in outcome.findings],
    }
