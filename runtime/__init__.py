"""The fixed-rate loop, its outputs, and the command lines."""
