"""Prints a line and a table, as a benchmark does."""

import sys

print("three lines\n\n| a | b |\n|---|---|\n| 1 |", sys.argv[1], "|")
