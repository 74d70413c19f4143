"""Properties of DAQmx in general: what is asked, how a property is described, and its name.

Names and numbers are those of NI's protocol definition, such as ``AI_MAX`` of a channel; the
tables of the card's properties use the names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from nidaqmx._stubs import nidaqmx_pb2 as pb

from dearig.sim_backend.daqmx.card.channels import AnalogInput, AnalogOutput, Channel, Lines
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.names import expanded
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["Asked", "Getter", "Property", "accepted", "changed", "fixed", "given", "name_of"]


@dataclass(frozen=True)
class Asked:
    """Target of a property: the ``device``, and a ``task`` and ``channel`` if any.

    ``channel`` names channels in the task, channels of the device, lines, or a scale, by the group.
    """

    device: SimulatedCard
    task: Task | None = None
    channel: str = ""

    @property
    def own(self) -> Task:
        """Return the task; raises an error without one."""
        if self.task is None:
            raise DaqmxError(Code.INVALID_TASK)
        return self.task

    @property
    def where(self) -> str:
        """Return the names of the channel and the task for an error's text."""
        parts = [f"Channel Name: {self.channel}"] if self.channel else []
        parts += [f"Task Name: {self.task.name}"] if self.task is not None else []
        return "; ".join(parts)

    def selected(self) -> list[Channel]:
        """Return the addressed channels of the task, without a name all of them."""
        task = self.own
        if not task.channels:
            raise DaqmxError(Code.NOT_WITHOUT_CHANNELS, f"Task Name: {task.name}")
        # names are not case-sensitive; a list or a range such as Dev1/ai0:2 names several
        named = {channel.name.lower(): channel for channel in task.channels}
        wanted = [n for part in self.channel.split(",") for n in expanded(part.strip())]
        if not self.channel.strip():
            return list(task.channels)
        for name in wanted:
            if name.lower() not in named:
                raise DaqmxError(
                    Code.CHANNEL_NOT_IN_TASK, f"Channel Name: {name}; Task Name: {task.name}"
                )
        return [named[name.lower()] for name in wanted]

    def each(self) -> Iterator[Asked]:
        """Yield the same question for each of the addressed channels."""
        for channel in self.selected():
            yield replace(self, channel=channel.name)

    def first(self) -> Channel:
        """Return the first of the addressed channels of the task."""
        return self.selected()[0]

    def analog(self) -> AnalogInput | AnalogOutput:
        """Return the same channel; raises an error unless it is analog."""
        channel = self.first()
        if not isinstance(channel, AnalogInput | AnalogOutput):
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, self.where)
        return channel

    def input(self) -> AnalogInput:
        """Return the same channel; raises an error unless it is an analog input."""
        channel = self.first()
        if not isinstance(channel, AnalogInput):
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, self.where)
        return channel

    def output(self) -> AnalogOutput:
        """Return the same channel; raises an error unless it is an analog output."""
        channel = self.first()
        if not isinstance(channel, AnalogOutput):
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, self.where)
        return channel

    def digital(self) -> Lines:
        """Return the same channel; raises an error unless it has digital lines."""
        channel = self.first()
        if not isinstance(channel, Lines):
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, self.where)
        return channel

    def of_kind(self, *kinds: Kind) -> Task:
        """Return the task; raises an error unless it is of one of ``kinds``."""
        if self.own.kind not in kinds:
            raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, self.where)
        return self.own


Getter = Callable[[Asked], Any]
Setter = Callable[[Asked, Any], None]


@dataclass(frozen=True)
class Property:
    """One property: how it is read and, where it can be, how it is set and what a reset sets.

    ``running`` is True if it may also be set while the task runs, ``effect`` False if its value is
    only kept.
    """

    get: Getter
    set: Setter | None = None
    default: Getter | None = None
    running: bool = False
    effect: bool = True


def _getter(value: Any) -> Getter:
    return value if callable(value) else lambda _: value


def given(value: Any) -> Property:
    """Return a property that is only read; ``value`` is its value or a getter."""
    return Property(_getter(value))


def changed(get: Getter, set_: Setter, default: Any = None, *, running: bool = False) -> Property:
    """Return a property with an effect in the simulation; ``default`` None: it has no reset."""
    return Property(get, set_, None if default is None else _getter(default), running)


def fixed(value: Any, *more: Any) -> Property:
    """Return a property that has the ``value`` or getter, and accepts nothing else.

    ``more`` are other ways to ask for the same.
    """
    get = _getter(value)

    def check(asked: Asked, wanted: Any) -> None:
        present = get(asked)
        if wanted != present and wanted not in more:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Requested Value: {wanted}; You Can Select: {present}; {asked.where}",
            )

    return Property(get, check, get)


def accepted(
    value: Any, *allowed: Any, needs: Getter | None = None, key: object = None
) -> Property:
    """Return a property that is kept and given back, without an effect in the simulation.

    ``value`` is its default or a getter, ``allowed`` the values that it may take (none: all).
    ``needs`` raises an error where the task or channel has no such property. ``key`` is for those
    who look at the value, as to refuse what is not simulated only when it would take effect.
    """
    key, default = key or object(), _getter(value)

    def check(asked: Asked) -> None:
        if needs is not None:
            needs(asked)

    def get(asked: Asked) -> Any:
        check(asked)
        return _kept(asked).get(key, default(asked))

    def set_(asked: Asked, wanted: Any) -> None:
        check(asked)
        if allowed and wanted not in allowed:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Requested Value: {wanted}; You Can Select: "
                f"{', '.join(str(one) for one in allowed)}; {asked.where}",
            )
        _kept(asked)[key] = wanted

    def reset(asked: Asked) -> Any:
        _kept(asked).pop(key, None)
        return default(asked)

    return Property(get, set_, reset, effect=False)


def _kept(asked: Asked) -> dict[object, Any]:
    """Return where the accepted values of the question's target are kept."""
    if asked.task is None:
        return asked.device.state.kept
    return asked.first().kept if asked.channel else asked.task.kept_properties


def _names() -> dict[tuple[str, int], str]:
    """Return the name of each property by group and number, from NI's protocol definition."""
    names = {}
    for method in pb.DESCRIPTOR.services_by_name["NiDAQmx"].methods:
        found = re.match(r"(?:Get|Set|Reset)([A-Za-z]+?)Attribute", method.name)
        if found and "attribute" in method.input_type.fields_by_name:
            for value in method.input_type.fields_by_name["attribute"].enum_type.values:
                name = value.name.partition("_ATTRIBUTE_")[2]
                names[found[1], value.number] = name
    return names


#: Not in the protocol's list: the client asks for it by number.
_UNLISTED = {("Read", 0x31E8): "DEFAULT_NUMBER_OF_SAMPLES_TO_READ"}
NAMES: Mapping[tuple[str, int], str] = {**_names(), **_UNLISTED}


def name_of(group: str, number: int) -> str:
    """Return the name of the property ``number`` of ``group``, such as ``AI_MAX``."""
    return NAMES.get((group, number), f"{number:#06x}")
