"""Import of measured data in the window."""
