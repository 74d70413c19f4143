"""Effects of electrodes and dielectric."""
