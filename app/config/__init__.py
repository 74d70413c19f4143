"""Files that people write: rig, sequence and model files, and the presets."""
