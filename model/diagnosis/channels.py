"""What the voltage monitor and the current say of a fit: evidence, and what they deny.

Numbers of equations are those of ``app/docs/explanation/diagnosis.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import EFFECTS, EffectValues
from dearig.model.fitting.channels import (
    ChannelMisfit,
    Channels,
    drops,
    is_electric,
)
from dearig.model.readings.channels import CURRENT, VOLTAGE_MONITOR
from dearig.model.simulation.actuator import Actuator

__all__ = ["ChannelEvidence", "ChannelSays", "Denial"]

_TITLES = {VOLTAGE_MONITOR: "voltage monitor", CURRENT: "current"}
_SHOWN = {"V": (1.0, "V"), "A": (1e6, "uA")}


def _shown(value: float, unit: str) -> str:
    """Return ``value`` in an SI ``unit`` as a person reads it, to three digits."""
    factor, shown = _SHOWN[unit]
    return f"{float(f'{factor * value:.3g}'):g} {shown}"


@dataclass(frozen=True)
class ChannelSays:
    """What a ``channel`` says of an effect: ``confirms``, ``denies`` or ``silent``; a sentence."""

    channel: str
    verdict: str
    text: str


@dataclass(frozen=True)
class Denial:
    """An effect that explains the displacement, and the channel that denies it.

    The effect would change the channel by ``implied`` RMS; what the plain circuit leaves of it is
    ``seen``, and the noise of each of so many independent ``means`` is ``noise``, in ``unit``.
    """

    effect: str
    family: str
    channel: str
    implied: float
    seen: float
    noise: float
    unit: str
    means: float

    @property
    def is_of_monitor(self) -> bool:
        """Whether the voltage monitor denies a fault of the amplifier."""
        return self.channel == VOLTAGE_MONITOR and self.family == "amplifier"

    @property
    def text(self) -> str:
        """What the channel says, in a sentence."""
        implied, seen, noise = (_shown(v, self.unit) for v in (self.implied, self.seen, self.noise))
        behind = ""
        if self.is_of_monitor:
            behind = ". It does not exclude a fault behind the point that the monitor reads"
        return (
            f"{self.effect} would explain the displacement, but the {_TITLES[self.channel]} denies "
            f"it: the channel would change by {implied} RMS, and differs from the model without "
            f"{self.effect} by {seen} (noise {noise} in each of {self.means:,.0f} means){behind}"
        )


def _without(model: Actuator, effect: str) -> Actuator:
    return replace(model, effects=tuple(e for e in model.effects if e[0] != effect))


class ChannelEvidence:
    """Evidence of the electrical ``channels``, relative to the plain film's circuit.

    Of each channel C = n ln((c + delta^2 (c0 - c))/c0), with the mean square c of its residual over
    the noise, c0 that of the plain circuit and n independent means: (12).
    """

    def __init__(self, channels: Channels, settings: DiagnosisSettings, plain: Actuator) -> None:
        self._channels, self._settings = channels, settings
        self._plain = replace(plain, effects=())
        self.plain = channels.misfits(self._plain)
        self._known: dict[EffectValues, dict[str, float]] = {}

    def see(self, model: Actuator) -> None:
        """Take account of what ``model`` leaves of the channels in the weight that they have."""
        if self._channels.see(self._electric(model)):
            self._known.clear()

    def of(self, model: Actuator) -> dict[str, float]:
        """Return C of ``model`` by channel; 0 for the plain circuit."""
        if model.effects not in self._known:
            electric = self._electric(model)
            self._known[model.effects] = {
                name: self._value(name, misfit)
                + (math.log(misfit.samples) if name == CURRENT and drops(electric) else 0.0)
                for name, misfit in self._channels.misfits(electric).items()
            }
        return self._known[model.effects]

    def _electric(self, model: Actuator) -> Actuator:
        return replace(self._plain, effects=tuple(e for e in model.effects if is_electric(e[0])))

    def _value(self, name: str, misfit: ChannelMisfit) -> float:
        base, form = self.plain[name].cost, self._settings.form_error**2
        return misfit.samples * math.log((misfit.cost + form * (base - misfit.cost)) / base)

    def total(self, model: Actuator) -> float:
        """Return C of ``model``, summed over the channels."""
        return sum(self.of(model).values())

    def denied(self, model: Actuator) -> tuple[str, str] | None:
        """Return an effect of ``model`` that a channel denies, and the channel; None without any.

        A channel denies an effect where it is more probable without it, by the odds that tell two
        explanations apart.
        """
        here = self.of(model)
        for name, _ in model.effects:
            if not is_electric(name):
                continue
            without = self.of(_without(model, name))
            for channel, value in here.items():
                if value - without[channel] > self._settings.alike:
                    return name, channel
        return None

    def is_open(self, model: Actuator) -> bool:
        """Whether a function of the voltage explains most of what ``model`` leaves of a channel."""
        s = self._settings
        for name, misfit in self._channels.misfits(self._electric(model)).items():
            least, numbers = self._channels.explicable(name)
            above = misfit.cost - 1.0
            price = s.odds + numbers * math.log(max(misfit.samples, 2.0))
            gain = misfit.samples * math.log(misfit.cost / least)
            if gain > price and misfit.cost - least > s.share * above > 0.0:
                return True
        return False

    def demands(self, parent: Actuator, model: Actuator) -> bool:
        """Whether a channel supports ``model`` over ``parent`` decisively."""
        s, before, after = self._settings, self.of(parent), self.of(model)
        left = self._channels.misfits(self._electric(parent))
        now = self._channels.misfits(self._electric(model))
        return any(
            before[n] - after[n] > s.odds
            and left[n].cost - now[n].cost > s.share * max(left[n].cost - 1.0, 0.0)
            for n in after
        )

    def denial(self, effect: str, model: Actuator) -> Denial | None:
        """Return what a channel says against ``effect`` with its values in ``model``, if any."""
        alone = replace(model, effects=tuple(e for e in model.effects if e[0] == effect))
        rest = _without(model, effect)
        here, without = self.of(model), self.of(rest)
        against = [n for n in here if here[n] - without[n] > self._settings.alike]
        if not against:
            return None
        channel = max(against, key=lambda n: here[n] - without[n])
        left = self._channels.misfits(self._electric(rest))[channel]
        return Denial(
            effect,
            EFFECTS[effect].family,
            channel,
            self._channels.implied(self._electric(alone), channel),
            left.rms,
            left.noise,
            self._channels.units[channel],
            left.samples,
        )

    def says(self, model: Actuator, effect: str) -> tuple[ChannelSays, ...]:
        """Return what each channel says of one ``effect`` of ``model``."""
        rest = _without(model, effect)
        here, without = self.of(model), self.of(rest)
        misfits = [self._channels.misfits(self._electric(m)) for m in (rest, model)]
        said = []
        for name in self._channels.used:
            unit = self._channels.units[name]
            odds = without[name] - here[name]
            before, after = (_shown(m[name].rms, unit) for m in misfits)
            noise = _shown(misfits[1][name].noise, unit)
            left = f"without it {before} RMS are left, with it {after} (noise {noise})"
            title = _TITLES[name]
            if odds > self._settings.alike:
                said.append(ChannelSays(name, "confirms", f"the {title} confirms it: {left}"))
            elif odds < -self._settings.alike:
                said.append(ChannelSays(name, "denies", f"the {title} denies it: {left}"))
            else:
                same = f"the {title} is the same with it and without it: {after} RMS"
                said.append(ChannelSays(name, "silent", f"{same} (noise {noise})"))
        return tuple(said)
