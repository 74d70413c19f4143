"""Instruments next to the card: amplifier, laser, thermohygrometer."""
