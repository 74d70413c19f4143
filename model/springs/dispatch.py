"""The functions of all strain energies by the code of the law, compiled.

A code is a position in ``registry.MODULES``. ``shape`` is (limit, a, b, c): the law's parameters,
``limit`` at 0 and the others in their order, whatever a law does not have at any value. All results
are per unit modulus, which is the initial shear modulus in Pa (for Arruda-Boyce nearly so).

The source is written from the modules of the laws: each function calls the one of the same name in
the module of the law, and returns a fixed value for a law without it.
"""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import Any

from dearig.model.compiled.generated import generated_module
from dearig.model.springs.registry import MODULES

__all__ = [
    "Shape",
    "curvature",
    "energy",
    "has_principal",
    "locking_strain",
    "principal_energy",
    "principal_pull",
    "principal_pull_slope",
    "slope",
]

Shape = tuple[float, float, float, float]

#: Arguments of each function of a law, and its value for a law without it.
_FUNCTIONS = MappingProxyType(
    {
        "energy": ("strain, shape", "0.0"),
        "slope": ("strain, shape", "0.0"),
        "curvature": ("strain, shape", "0.0"),
        "principal_energy": ("stretch, shape", "0.0"),
        "principal_pull": ("stretch, shape", "0.0"),
        "principal_pull_slope": ("stretch, shape", "0.0"),
        "locking_strain": ("shape", 'float("inf")'),
    }
)


def _text() -> str:
    """Return the source of the functions."""
    lines = ["from dearig.model.compiled.jit import jit"]
    lines += [f"import {module.__name__} as law_{code}" for code, module in enumerate(MODULES)]
    for name, (arguments, without) in _FUNCTIONS.items():
        lines += ["", "", "@jit", f"def {name}(kind, {arguments}):"]
        for code, module in enumerate(MODULES):
            if hasattr(module, name):
                lines += [
                    f"    if kind == {code}:",
                    f"        return law_{code}.{name}({arguments})",
                ]
        lines.append(f"    return {without}")
    principal = [code for code, module in enumerate(MODULES) if hasattr(module, "principal_energy")]
    tests = " or ".join(f"kind == {code}" for code in principal)
    lines += ["", "", "@jit", "def has_principal(kind):", f"    return {tests}"]
    return "\n".join([*lines, ""])


_laws: Any = generated_module("dearig.model.springs.assembled_laws", _text())
_Function = Callable[..., float]

#: U at ``strain`` = I1 - 3.
energy: _Function = _laws.energy
#: dU/dI1.
slope: _Function = _laws.slope
#: d2U/dI1^2.
curvature: _Function = _laws.curvature
#: w at a principal ``stretch``; 0 at 1.
principal_energy: _Function = _laws.principal_energy
#: lam dw/dlam at a principal ``stretch``, but for a constant that cancels.
principal_pull: _Function = _laws.principal_pull
#: Derivative of ``principal_pull`` by the stretch.
principal_pull_slope: _Function = _laws.principal_pull_slope
#: I1 - 3 at the locking stretch, beyond which the spring has no energy.
locking_strain: _Function = _laws.locking_strain
#: Whether the law has terms in the principal stretches.
has_principal: Callable[[int], bool] = _laws.has_principal
