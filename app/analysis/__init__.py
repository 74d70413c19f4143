"""Analysis of recordings: quality, fits, validation, prediction and diagnosis."""
