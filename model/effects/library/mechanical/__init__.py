"""Effects of film stress, load and guide."""
