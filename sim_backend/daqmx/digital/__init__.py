"""Digital lines, counters and pulses of the card."""
