"""Effects of the air of the room."""
