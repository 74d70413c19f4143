"""Drivers of the rigs' instruments."""

# before any other module of this package, so that the digests are those of what is imported
from dearig.drivers import sources as sources
