"""Inverse kinematics: legs, arms, spine; plain functions over batches."""
