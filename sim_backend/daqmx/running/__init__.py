"""What holds for tasks of every kind while they run: states, buffers, events."""
