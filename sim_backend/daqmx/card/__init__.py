"""The card: tasks, clocks, triggers, outputs, inputs and their wiring."""
