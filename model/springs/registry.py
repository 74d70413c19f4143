"""All strain energies, in the order of the integer codes that the kernels use.

A new one is a file with ``SPRING`` and its functions, a line here, and its lines in ``dispatch``.
The first two are integrated in closed form (``kernel.exponential_rk``); those from
``FIRST_PRINCIPAL`` on have terms in the principal stretches.
"""

from __future__ import annotations

from types import MappingProxyType, ModuleType

from dearig.model.springs import (
    arruda_boyce,
    extended_tube,
    gent,
    mooney_rivlin,
    neo_hookean,
    ogden,
    ogden_two_terms,
    yeoh,
)
from dearig.model.springs.description import SpringLaw

__all__ = ["FIRST_PRINCIPAL", "MODULES", "SPRINGS", "SPRING_LAWS"]

#: The module of each strain energy.
MODULES: tuple[ModuleType, ...] = (
    neo_hookean,
    gent,
    arruda_boyce,
    yeoh,
    mooney_rivlin,
    ogden,
    ogden_two_terms,
    extended_tube,
)
#: Descriptions by name.
SPRING_LAWS: MappingProxyType[str, SpringLaw] = MappingProxyType(
    {module.SPRING.name: module.SPRING for module in MODULES}
)
#: Names in the order of the codes.
SPRINGS: tuple[str, ...] = tuple(SPRING_LAWS)
FIRST_PRINCIPAL = MODULES.index(mooney_rivlin)
