"""Registries: what this program brings, and what other distributions add by entry points."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from typing import Any, Generic, TypeVar

__all__ = ["Plugin", "Registry"]

T = TypeVar("T")

_SHOWN = 200  # characters of another program's error text


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """One entry of a registry.

    Attributes
    ----------
    group, name : str
        The entry point's group, and what the entry is called in rig files and addresses.
    source : str
        Name and version of the distribution that brings it; empty for this program's own.
    value : T or None
        What is used; None where it cannot be.
    failure : str
        Why it cannot be used, in one sentence; empty where it can.
    """

    group: str
    name: str
    source: str
    value: T | None
    failure: str = ""


class Registry(Generic[T]):
    """The entries of one entry point ``group``: this program's own and other distributions'.

    Parameters
    ----------
    group : str
        Group of the entry points by which other distributions add entries.
    kind : type
        Runtime-checkable protocol that each entry has.
    key : str
        Attribute of an entry that holds its name.
    own : iterable of T
        The entries of this program. Nobody can take their names.
    """

    def __init__(self, group: str, kind: type[Any], key: str, own: Iterable[T]) -> None:
        self._group = group
        self._kind = kind
        self._key = key
        self._own = tuple(own)

    @cached_property
    def plugins(self) -> tuple[Plugin[T], ...]:
        """All that was found, this program's own first; an entry that fails is among them."""
        found = [Plugin(self._group, getattr(one, self._key), "", one) for one in self._own]
        taken = {plugin.name for plugin in found}
        for point in metadata.entry_points(group=self._group):
            plugin = self._loaded(point, taken)
            found.append(plugin)
            if plugin.value is not None:
                taken.add(plugin.name)
        return tuple(found)

    def names(self) -> tuple[str, ...]:
        """Return the names of the entries that can be used."""
        return tuple(plugin.name for plugin in self.plugins if plugin.value is not None)

    def values(self) -> tuple[T, ...]:
        """Return the entries that can be used."""
        return tuple(plugin.value for plugin in self.plugins if plugin.value is not None)

    def get(self, name: str) -> T | None:
        """Return the entry called ``name``; None where there is none that can be used."""
        for plugin in self.plugins:
            if plugin.name == name and plugin.value is not None:
                return plugin.value
        return None

    def failure(self, name: str) -> str:
        """Return why the entry called ``name`` cannot be used; empty where there is none."""
        failures = (p.failure for p in self.plugins if p.name == name and p.value is None)
        return next(failures, "")

    def _loaded(self, point: metadata.EntryPoint, taken: set[str]) -> Plugin[T]:
        source = f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown package"

        def left_out(name: str, why: str) -> Plugin[T]:
            sentence = f"{self._group} {name!r} of {source} is left out: {why}"
            return Plugin(self._group, name, source, None, sentence)

        try:
            value = point.load()
        except Exception as error:  # noqa: BLE001  (whatever a foreign module raises)
            text = " ".join(str(error).split())[:_SHOWN]
            return left_out(point.name, f"{point.value} fails with {type(error).__name__}: {text}")
        if not isinstance(value, self._kind):
            missing = [name for name in sorted(_members(self._kind)) if not hasattr(value, name)]
            return left_out(
                point.name, f"{point.value} is no {self._kind.__name__}: it lacks {missing}"
            )
        name = getattr(value, self._key)
        if name in taken:
            return left_out(name, "the name is taken by another one")
        return Plugin(self._group, name, source, value)


def _members(protocol: type) -> set[str]:
    """Return the names that ``protocol`` asks for."""
    names = {name for base in protocol.__mro__ for name in getattr(base, "__annotations__", {})}
    names |= {name for base in protocol.__mro__ for name, value in vars(base).items()
              if callable(value)}  # fmt: skip
    return {name for name in names if not name.startswith("_")}
