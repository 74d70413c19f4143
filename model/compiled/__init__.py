"""Compiled kernels: decorators, disk cache, other distributions' sources."""
