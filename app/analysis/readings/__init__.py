"""What one recording's readings are worth: opened, checked, their noise known, ready to fit."""
