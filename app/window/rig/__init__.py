"""The page Rig."""
