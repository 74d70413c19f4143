"""Reports: what was found, as figures and as one page that can be read anywhere."""
