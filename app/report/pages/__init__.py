"""Pages of reports: HTML in one file, and its printing."""
