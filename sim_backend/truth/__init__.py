"""The truth: films with hidden effects, for the diagnosis to find.

Nothing here knows the model's effects or its integrator. ``cases`` draws a film by seed; ``film``
is its physics; each file in ``effects`` holds one effect that it may have.
"""
