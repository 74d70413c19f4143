"""Python interface for notebooks and scripts; ``import dearig`` gives its names."""
