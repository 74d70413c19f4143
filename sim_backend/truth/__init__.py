"""Films with hidden effects, for the diagnosis to find.

This package is independent of the model's effects and integrator. ``cases`` draws a film by seed,
``film`` holds its physics, and each file in ``effects`` holds one effect that it may have.
"""
