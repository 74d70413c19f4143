"""Effects of a film that creeps."""
