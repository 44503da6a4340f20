"""From a T-pose to tracker offsets and body measures: pure functions and the profile file."""
