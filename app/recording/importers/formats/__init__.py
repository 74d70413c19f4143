"""File formats: from bytes to columns."""
