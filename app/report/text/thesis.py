"""Published values of the thesis, for comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dearig.model.simulation.actuator import Actuator
    from dearig.model.simulation.strip import Strip

__all__ = ["SIMULATED_CAVEAT", "table_3"]

#: Next to every comparison of errors on simulated recordings with the thesis's measured errors.
SIMULATED_CAVEAT = (
    "These recordings are simulated. The thesis's errors are of a measured film, so the comparison "
    "does not show how well the model describes a real film."
)


def table_3(model: Actuator | Strip) -> dict[str, float]:
    """Return Table 3 by parameter name (SI); empty unless ``model`` has as many branches.

    The branches are sorted by relaxation time, as fitted ones are, so that similar branches have
    the same name.
    """
    from dearig.model.film.material import TABLE_3
    from dearig.model.simulation.actuator import Actuator

    if not isinstance(model, Actuator) or len(model.network.branches) != len(TABLE_3.branches):
        return {}
    branches = sorted(TABLE_3.branches, key=lambda b: b.relaxation_time)
    springs = (TABLE_3.equilibrium, *(b.spring for b in branches))
    values = {f"mu_{i}": s.modulus for i, s in enumerate(springs)}
    values |= {f"J_{i}": s.limit for i, s in enumerate(springs)}
    return values | {f"T_{i}": b.relaxation_time for i, b in enumerate(branches, 1)}
