"""A run: its plan, the check of the rig, the recording, and an overlay model in step with it."""
