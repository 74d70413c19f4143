"""Properties of card, tasks, channels, timing and triggers."""
