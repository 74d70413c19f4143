"""All strain energies, in the order of the integer codes that the kernels use."""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType, ModuleType

from dearig.model.spring_names import SPRING_MODULES
from dearig.model.springs.description import SpringLaw

__all__ = ["MODULES", "SPRING_LAWS"]

#: The module of each strain energy.
MODULES: tuple[ModuleType, ...] = tuple(
    import_module(f"dearig.model.springs.{name}") for name in SPRING_MODULES
)
#: Descriptions by name.
SPRING_LAWS: MappingProxyType[str, SpringLaw] = MappingProxyType(
    {module.SPRING.name: module.SPRING for module in MODULES}
)
