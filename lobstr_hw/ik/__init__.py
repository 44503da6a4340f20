"""Inverse kinematics: legs, arms, spine; plain functions over batches."""

from lobstr_hw.ik.arms import solve_arms
from lobstr_hw.ik.jacobian import LegBones, LegPose, solve_legs
from lobstr_hw.ik.spine import SpineSettings, solve_spine
from lobstr_hw.ik.two_bone import bend_and_swing, limb_rotations, solve_two_bone

__all__ = [
    "LegBones",
    "LegPose",
    "SpineSettings",
    "bend_and_swing",
    "limb_rotations",
    "solve_arms",
    "solve_legs",
    "solve_spine",
    "solve_two_bone",
]
