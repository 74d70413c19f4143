"""Set-up of the card: channels, timing, triggers, routes, and the checks of each."""
