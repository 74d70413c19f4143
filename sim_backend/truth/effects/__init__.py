"""Hidden effects, a file each: a function that draws one effect from a generator.

To add one, add a file and list its function in ``sim_backend.truth.cases``.
"""
