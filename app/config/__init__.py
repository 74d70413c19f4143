"""Files that a person keeps: rig, sequence and model files, and the named sequences."""
