"""Effects of the amplifier."""
