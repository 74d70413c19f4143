"""The truth: films that hide effects nobody declared, for the diagnosis to find.

Nothing here knows the model's effects or its integrator. ``cases`` draws a film by seed; ``film``
is its physics; each file in ``effects`` is one thing that may be wrong with it.
"""
