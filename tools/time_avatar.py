"""What a tick costs without the network: Avatar.step and the legs' IK, for 1 and for 256 people.

python tools/time_avatar.py [--repeat 300]
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from lobstr_hw.avatar import Avatar
from lobstr_hw.ik import LegBones, LegPose, solve_legs
from lobstr_hw.predictors import load_predictor
from lobstr_hw.predictors.predictor import Frame
from lobstr_hw.rotations import from_rotation_vector, rotation_x
from lobstr_hw.skeleton import STANDARD_OFFSETS, Body, forward_kinematics
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=300)
    repeat = parser.parse_args().repeat
    for n in (1, 256):
        said("tick", n, avatar_step(n), repeat)
        for name, down_m in (("legs in reach", -0.03), ("legs stretched", 0.05)):
            said(name, n, leg_ik(n, down_m), repeat)
    return 0


def said(name: str, n: int, work: Callable[[], object], repeat: int) -> None:
    took = []
    for _ in range(repeat):
        began = time.perf_counter()
        work()
        took.append(1e3 * (time.perf_counter() - began))
    p50, p99 = np.percentile(took, [50, 99])
    print(f"{name:15s} n = {n:3d}   p50 {p50:6.3f} ms   p99 {p99:6.3f} ms")


def avatar_step(n: int) -> Callable[[], object]:
    """A tick between two grid times, both feet locked, at twice the network's rate."""
    rng = np.random.default_rng(0)
    R_local = from_rotation_vector(rng.normal(scale=0.2, size=(n, 22, 3)))
    p, R = forward_kinematics(R_local, np.broadcast_to([0.0, 0.97, 0.0], (n, 3)))
    joints = [ROLE_JOINT[role] for role in FOUR_POINTS]
    valid = np.ones((n, 4), dtype=np.bool_)
    frames = [
        Frame(k / 45, FOUR_POINTS, p[:, joints], R[:, joints], valid, valid) for k in range(4)
    ]
    avatar = Avatar(load_predictor("standing"), Body.standard(n), loop_rate_hz=90.0)
    state = avatar.start()
    for frame in frames:
        state, _ = avatar.step(state, frame, [frame])
    return lambda: avatar.step(state, frames[-1])


def leg_ik(n: int, down_m: float) -> Callable[[], object]:
    """Both legs, their toes to be moved by 4 cm and up or down."""
    rng = np.random.default_rng(0)
    bones = LegBones(
        *(np.broadcast_to(STANDARD_OFFSETS[[j, j + 4]], (n, 2, 3)) for j in (15, 16, 17))
    )
    upper = from_rotation_vector(rng.normal(scale=0.1, size=(n, 2, 3)))
    lower = upper @ rotation_x(np.full((n, 2), 0.15))
    pose = LegPose(upper, lower, lower @ rotation_x(np.full((n, 2), -0.1)))
    p_hip = np.broadcast_to([[0.09, 0.9, 0.0], [-0.09, 0.9, 0.0]], (n, 2, 3))
    target = pose.toe(p_hip, bones) + np.array([0.0, -down_m, 0.04])
    return lambda: solve_legs(pose, p_hip, bones, target)


if __name__ == "__main__":
    raise SystemExit(main())
