"""Registry entry of rigs on an NI card."""

from __future__ import annotations

from dearig.drivers.daqmx import inspection, rig
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.inputs import DaqmxInputs
from dearig.drivers.inputs import Inputs
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.registered import instrument_findings, reading_findings
from dearig.drivers.rig import Rig
from dearig.drivers.rig_kind import RigOptions
from dearig.drivers.settings import RigSettings

__all__ = ["KIND", "DaqmxKind"]


class DaqmxKind:
    """Rig on a card through NI-DAQmx, in this computer or behind a server; see ``RigKind``."""

    addresses: tuple[str, ...] = ("daqmx:Dev1", "daqmx:Dev1@HOST:PORT")
    simulated = False

    def open(self, address: str, settings: RigSettings, options: RigOptions) -> Rig:  # noqa: ARG002
        """Return the rig at ``address``, with a guardian process."""
        return rig.open_daqmx_rig(address, settings)

    def open_inputs(
        self,
        address: str,
        settings: RigSettings,
        options: RigOptions,  # noqa: ARG002
    ) -> Inputs:
        """Return the inputs of the card at ``address``; see ``ReadsInputs``."""
        return DaqmxInputs(Address.parse(address), settings)

    def inspect(
        self,
        address: str,
        settings: RigSettings,
        options: RigOptions,  # noqa: ARG002
    ) -> tuple[Finding, ...]:
        """Return the findings on card, amplifier, laser and declared channels."""
        where = Address.parse(address)
        card = inspection.inspect(where.device, where.server, settings)
        return (
            *card.findings,
            *instrument_findings(settings, card.monitors, card.displacement_volts),
            *reading_findings(settings, card.readings),
        )


#: Entry of the registry.
KIND = DaqmxKind()
