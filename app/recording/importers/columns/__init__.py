"""Which column is which quantity."""
