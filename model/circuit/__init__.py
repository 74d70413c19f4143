"""The electric circuit along a given stretch: amplifier, electrodes, film, and their current."""
