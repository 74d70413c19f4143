"""By how much the voltage monitor and the current would tell two models apart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from dearig.analysis.readings.record import Readings
from dearig.model.circuit import loop
from dearig.model.coefficients import CAPACITANCE, LENGTH
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.fitting.channels import Channels
from dearig.model.fitting.thinning import RATE
from dearig.model.kernel import OK
from dearig.model.readings.channels import VOLTAGE_MONITOR, ChannelRecord, ElectricRecord
from dearig.model.simulation.actuator import Actuator, Drive, at_rest

__all__ = ["AVERAGED", "RigChannels", "channels_of"]

#: Conversions in a row, of a recording that is to show the current of a film that charges: of as
#: many the noise is a tenth, and the mean has all of the charge that a step brings.
AVERAGED = 100


@dataclass(frozen=True)
class RigChannels:
    """Electrical channels of a rig, each with the noise of one conversion."""

    channels: tuple[ChannelRecord, ...] = ()

    def apart(
        self,
        a: Actuator,
        b: Actuator,
        drive: Drive,
        displacement: np.ndarray,
        conversions: float,
        means: bool,
    ) -> Mapping[str, tuple[float, float]]:
        """Return what each channel would say of ``b`` if the film were ``a``, by name.

        Chi-square, and the RMS over the noise, of means at 200 Hz. ``displacement`` (N,) m is that
        of ``a`` under ``drive``; there are so many ``conversions`` to each of its values, which are
        ``means`` or instants. The channel's own gain, its offset and a cable explain none of it. A
        channel that would show nothing is left out.
        """
        rows = self._rows(a, drive, displacement, means)
        seen = tuple(
            replace(
                channel,
                values=rows[loop.OUTPUT if channel.name == VOLTAGE_MONITOR else loop.INTO],
                noise=channel.noise / math.sqrt(conversions),
                lead_in=0,
            )
            for channel in self.channels
        )
        record = ElectricRecord("", drive, displacement, 0, seen, means)
        misfits = Channels([record], b).misfits(b)
        step = float(np.median(np.diff(drive.time)))
        count = drive.time.size // max(1, int(1.0 / (RATE * step) + 1e-6))
        return {name: (m.cost * count, math.sqrt(m.cost)) for name, m in misfits.items()}

    def _rows(
        self, model: Actuator, drive: Drive, displacement: np.ndarray, means: bool
    ) -> np.ndarray:
        """Return the rows of ``loop.follow`` of ``model``; its current is the least of its law."""
        c = model.coefficients()
        status, rest = at_rest(c, drive)
        if status != OK:
            return np.zeros((loop.SLOPE + 1, drive.time.size))
        into = max((channel.skew for channel in self.channels), default=0.0)
        rows = loop.follow(
            c, drive.time, drive.voltage, drive.ends, drive.air, rest + displacement / c[LENGTH],
            loop.ABOUT if means else loop.AT, into,
        )  # fmt: skip
        # the resistance in series with a leak is not known: at most one that charges in a mean
        rows[loop.INTO] += c[CAPACITANCE] * RATE * rows[loop.DROP]
        return np.asarray(rows)


def channels_of(readings: Iterable[Readings], finding: Diagnosis) -> RigChannels:
    """Return the channels that recordings of the rig have shown to be of use.

    The monitor is left out where it denies a fault of the amplifier: the fault may lie behind it.
    """
    denied = {d.channel for d in finding.denials if d.is_of_monitor}
    used = {result.name for result in finding.channels if result.used} - denied
    best: dict[str, ChannelRecord] = {}
    for each in readings:
        electric = getattr(each.record, "electric", None)  # films have none
        for channel in electric.used if electric is not None else ():
            one = replace(channel, noise=channel.noise * math.sqrt(each.recording.average))
            known = best.get(channel.name)
            if channel.name in used and (known is None or one.noise < known.noise):
                best[channel.name] = one
    return RigChannels(tuple(best.values()))
