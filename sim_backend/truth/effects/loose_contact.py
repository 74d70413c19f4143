"""Loose contact: the lead touches the electrode only at high voltage. In no family.

The contact closes above one voltage and opens below another; between the two it keeps its state.
While it is open, no voltage reaches the film, which discharges at once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.sampling import log_uniform
from dearig.sim_backend.truth.supply import Supply

__all__ = ["loose_contact"]

_CLOSES = (1100.0, 4200.0)  # V
_OPENS = (0.3, 0.9)  # of that


def loose_contact(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a contact with two threshold voltages."""
    closes = log_uniform(generator, *_CLOSES)
    opens = closes * generator.uniform(*_OPENS)

    def on_voltage(
        time: np.ndarray,  # noqa: ARG001
        supply: Supply,
        carry: object,
    ) -> tuple[Supply, object]:
        size = np.abs(supply.pull)
        decided = (size >= closes) | (size < opens)
        # each node takes the state of the last one that was decided, from the carried state on
        last = np.maximum.accumulate(np.where(decided, np.arange(1, size.size + 1), 0))
        closed = np.append(bool(carry), size >= closes)[last]
        # the last node's voltage is not valid yet: take the state of the interval before it
        reaching = supply.mapped(lambda voltage: np.where(closed, voltage, 0.0))
        return replace(reaching, joined=closed), bool(closed[-2] if closed.size > 1 else carry)

    return TruthEffect(
        family="unknown",
        acts_on="electrode",
        description=f"a contact closes above {closes:.4g} V and opens below {opens:.4g} V",
        on_voltage=on_voltage,
    )
