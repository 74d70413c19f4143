"""Reports of results: sentences, tables, figures, JSON, and HTML pages in one file."""
