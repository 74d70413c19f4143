"""Inspection of a rig before a run: instruments, errors, and the limits that apply."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from importlib import metadata
from itertools import groupby
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from dearig.acquisition.rigs import kind_of, options_of
from dearig.config.rigfile import RigFile
from dearig.drivers.daqmx.watchdog import WATCHDOG
from dearig.drivers.errors import AddressError, LinkRefused
from dearig.drivers.instruments.findings import Finding
from dearig.errors import InputError, InstrumentFault
from dearig.output_state import Known, OutputState
from dearig.sim_backend.faults import FaultPlan

__all__ = ["CheckOutcome", "check_json", "check_rig", "check_table"]


@dataclass(frozen=True)
class CheckOutcome:
    """The findings on the rig at address ``rig``.

    ``tolerance`` are the V within which the voltage monitor counts as 0 V.
    """

    rig: str
    simulated: bool
    findings: tuple[Finding, ...]
    tolerance: float | None = None

    @property
    def output(self) -> OutputState | None:
        """State of the output as the voltage monitor read it; None where it was not read."""
        readings = [finding.reading for finding in self.findings if finding.reading is not None]
        if not readings:
            return None
        reading = readings[-1]
        known = Known.CONFIRMED if reading.confirmed else Known.UNKNOWN
        return OutputState(known, reading.at, reading.voltage, tolerance=self.tolerance)

    @property
    def wrong(self) -> tuple[Finding, ...]:
        """The findings that prevent a run from starting."""
        return tuple(f for f in self.findings if f.verdict == "wrong")

    def refuse(self) -> None:
        """Raise an error with the first finding that prevents a run, if any.

        It is an ``InstrumentFault``, or an ``InputError`` where only the watchdog is undeclared.
        """
        if self.wrong:
            more = f" (and {len(self.wrong) - 1} more)" if len(self.wrong) > 1 else ""
            if all(finding.item == WATCHDOG for finding in self.wrong):
                self.refuse_without_watchdog()
            raise InstrumentFault(f"{self.wrong[0].sentence}{more}")

    def refuse_without_watchdog(self) -> None:
        """Raise ``InputError`` for a real card with neither a hardware watchdog nor a declaration.

        The declaration is ``card.i_have_no_watchdog``; a card that reports itself as simulated
        needs none.
        """
        for finding in self.wrong:
            if finding.item == WATCHDOG:
                others = [f.sentence for f in self.wrong if f is not finding]
                also = f" (also: {others[0]})" if others else ""
                raise InputError(f"rig {self.rig!r}: {finding.sentence}{also}")

    @property
    def summary(self) -> str:
        """Number of checks, and of those that are not OK, in one sentence."""
        counts = {
            "wrong": len(self.wrong),
            "to check": sum(f.verdict == "warning" for f in self.findings),
            "not wired": sum(f.verdict == "not wired" for f in self.findings),
        }
        others = ", ".join(f"{n} {what}" for what, n in counts.items() if n)
        return f"{len(self.findings)} checks: {others or 'all OK'}"


def check_rig(rig: str, rig_file: RigFile, faults: FaultPlan | None = None) -> CheckOutcome:
    """Inspect the instruments of the rig at address ``rig`` against ``rig_file``.

    A simulated rig plays 0 V and is read. Where ``laser.port`` is not empty, the driver asks a
    simulated controller; ``faults`` occur in it. Errors of instruments are findings. Raises
    ``InputError`` for an address that names no rig, or one that the rig file does not allow.
    """
    kind = kind_of(rig)
    options = replace(options_of(rig_file), faults=faults)
    try:
        instruments = kind.inspect(rig, rig_file, options)
    except (AddressError, LinkRefused) as error:
        raise InputError(str(error)) from error
    except ValueError as error:  # a film without a rest state
        raise InputError(f"rig {rig!r} with this rig file: {error}") from error
    findings = (*_programs(), *instruments, *_limits(rig_file, kind.simulated))
    tolerance = rig_file.limits.zero_tolerance_kV * 1e3
    return CheckOutcome(rig, kind.simulated, findings, tolerance)


# ---------------------------------------------------------------- findings on every rig


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
            name, "film", "none is named", "the name of the film on the rig", "wrong",
            "name it in [film] of the rig file: a run on real instruments needs it",
        )  # fmt: skip


# ---------------------------------------------------------------- output

_LOOKS = {"ok": "green", "warning": "yellow", "wrong": "bold red", "not wired": "dim"}


def check_table(outcome: CheckOutcome) -> RenderableType:
    """Return the findings by instrument, with advice for those that are not OK."""
    pieces: list[RenderableType] = []
    for instrument, group in groupby(outcome.findings, key=lambda finding: finding.instrument):
        table = Table(
            title=Text(instrument, style="bold"), title_justify="left",
            show_header=False, box=None, pad_edge=False,
        )  # fmt: skip
        table.add_column(no_wrap=True, width=max(map(len, _LOOKS)))
        table.add_column(overflow="fold")
        for finding in group:
            text = f"{finding.item}: {finding.found}"
            if finding.verdict != "ok":
                wanted = f", expected {finding.wanted}" if finding.wanted else ""
                text += wanted + (f"; {finding.advice}" if finding.advice else "")
            table.add_row(Text(finding.verdict, style=_LOOKS[finding.verdict]), Text(text))
        pieces.append(table)
    return Group(*pieces, Text(f"{outcome.rig}: {outcome.summary}."))


def _plain(finding: Finding) -> dict[str, Any]:
    """Return a finding as it is printed, without the reading that the window takes from it."""
    return {name: value for name, value in asdict(finding).items() if name != "reading"}


def check_json(outcome: CheckOutcome) -> dict[str, Any]:
    """Return the outcome for a JSON file."""
    return {
        "format": "dearig-check/1",
        "rig": outcome.rig,
        "simulated": outcome.simulated,
        "ok": not outcome.wrong,
        "well": not outcome.wrong,  # as "ok": the name in earlier versions
        "findings": [_plain(finding) for finding in outcome.findings],
    }
