"""Numbers, sentences and tables of reports."""
