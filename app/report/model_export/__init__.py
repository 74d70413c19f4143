"""Models for other programs: equations with numbers, a NumPy file, Prony series."""
