"""What the window remembers: the session, settings, layout, recovery."""
