"""Simulated users: bodies, mounts and tracking errors, for made logs, training and tests."""
