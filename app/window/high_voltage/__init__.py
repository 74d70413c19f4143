"""The state of the high voltage: status, bar, alarms, keys that stop a run."""
