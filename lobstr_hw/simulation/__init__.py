"""Tracker recordings made from motion clips: people, mounts and tracking errors, all seeded."""

from lobstr_hw.simulation.habits import Habits, Performance
from lobstr_hw.simulation.movement import calibrating_movement
from lobstr_hw.simulation.t_pose import PoseDeviation, Sway
from lobstr_hw.simulation.take import SimulatedTake, drawn_user, simulate, take_samples
from lobstr_hw.simulation.tracking_errors import TrackingErrors
from lobstr_hw.simulation.transitions import eased, joined, moved
from lobstr_hw.simulation.users import SimulatedUser, ideal_mounts

__all__ = [
    "Habits",
    "Performance",
    "PoseDeviation",
    "SimulatedTake",
    "SimulatedUser",
    "Sway",
    "TrackingErrors",
    "calibrating_movement",
    "drawn_user",
    "eased",
    "ideal_mounts",
    "joined",
    "moved",
    "simulate",
    "take_samples",
]
