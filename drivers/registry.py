"""Registries that other distributions extend through entry points."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, Generic, TypeVar

__all__ = ["EntryError", "Registry"]

log = logging.getLogger(__name__)

T = TypeVar("T")


class EntryError(AssertionError):
    """An entry of a registry does not do what every entry must do: which one, where, and how."""


class Registry(Mapping[str, T], Generic[T]):
    """Entries by name: the package's own, then those of other distributions.

    Entries are loaded when the registry is first read, so that a module which brings one can
    import the package that holds the registry. An entry of another distribution that cannot be
    used is left out, with a sentence in ``left_out`` and in the log.

    Parameters
    ----------
    group : str
        The group of entry points that is read.
    own : mapping
        The package's own entries, name to ``module:attribute``, as in an entry point.
    check : callable
        Called with name and object of every other entry; raises ``Exception`` with a sentence if
        the object is not what the registry holds.
    """

    def __init__(
        self, group: str, own: Mapping[str, str], check: Callable[[str, Any], None]
    ) -> None:
        self.group = group
        self._own = own
        self._check = check

    @cached_property
    def _loaded(self) -> tuple[Mapping[str, T], tuple[str, ...]]:
        found: dict[str, T] = {
            name: EntryPoint(name, value, self.group).load() for name, value in self._own.items()
        }
        left_out: list[str] = []
        # sorted: which of two entries of one name is used must not depend on the search path
        for point in sorted(entry_points(group=self.group), key=_order):
            try:
                if point.name in found:
                    raise ValueError(f"the name {point.name!r} is already taken")  # noqa: TRY301
                entry = point.load()
                self._check(point.name, entry)
            except (Exception, SystemExit) as error:  # noqa: BLE001  (foreign code: anything)
                text = " ".join(str(error).split()) or type(error).__name__
                left_out.append(
                    f"the plug-in {point.name} ({self.group}) of {_distribution(point)} is left "
                    f"out: {text}; update or uninstall it"
                )
                log.warning(left_out[-1])
            else:
                found[point.name] = entry
        return MappingProxyType(found), tuple(left_out)

    @property
    def left_out(self) -> tuple[str, ...]:
        """A sentence for each entry of another distribution that cannot be used."""
        return self._loaded[1]

    def __getitem__(self, name: str) -> T:
        """Return the entry ``name``."""
        return self._loaded[0][name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, the package's own first."""
        return iter(self._loaded[0])

    def __len__(self) -> int:
        """Count the entries."""
        return len(self._loaded[0])


def _distribution(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else "an unknown distribution"


def _order(point: EntryPoint) -> tuple[str, str]:
    return point.name, _distribution(point)
