"""The tracker log: MCAP files of samples, states and truth."""
