"""The page Recordings."""
