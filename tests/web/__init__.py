"""The web page of dearig watch."""
