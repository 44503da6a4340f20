"""The calibration wizard: a state machine of steps, and what shows it to people."""
