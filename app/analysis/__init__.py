"""From recordings to models and verdicts."""
