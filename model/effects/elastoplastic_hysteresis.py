"""Rate-independent hysteresis of the film itself: one yielding element in parallel to its springs.

Bouc and Wen's model with equal constants, which is Dahl's: a stress that approaches Y over the
stretch r against every reversal. The film's own loops open over a good part of the stroke, where
those of dry friction open within a few micrometres.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter

# one law, on another scale of stretch: the same functions, with numbers of their own
from model.effects.dry_friction import commit, stiffness, stress

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="elastoplastic hysteresis",
    family="rate_independent_hysteresis",
    acts_on="film stress",
    words="loops that do not depend on the speed, opening over a part of the stroke",
    parameters=(
        Parameter(
            "yield_stress", "Pa", (0.0, 2e5), "stress far from the last reversal", 200.0, 0.0
        ),
        Parameter(
            "reach",
            "",
            (1e-3, 1.0),
            "change of stretch over which the stress builds up",
            5e-3,
            starts=(5e-3, 2e-3, 1.5e-2, 0.2),
            logarithmic=True,
        ),
    ),
    memory=1,
    turns=True,
    drives=("voltage", "stretch"),
)
