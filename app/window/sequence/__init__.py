"""The page Sequence."""
