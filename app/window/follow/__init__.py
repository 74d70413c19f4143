"""The page Follow: tracking of a path, and holding of a displacement."""
