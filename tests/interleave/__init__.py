"""Commands on the same files at once: ``python -m tests.interleave --cases 2000``."""
