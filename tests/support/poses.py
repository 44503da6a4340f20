"""Skeleton poses for output tests."""

import numpy as np

from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.skeleton import Body, forward_kinematics
from lobstr_hw.skeleton_pose import RoleReport, SkeletonPose, Source
from lobstr_hw.trackers import FOUR_POINTS


def random_poses(seed: int, n: int, body: Body, rate_hz: float = 45.0) -> list[SkeletonPose]:
    """Poses that move, one person, from time 3 s on."""
    rng = np.random.default_rng(seed)
    poses = []
    for k in range(n):
        R_local = from_rotation_vector(rng.normal(scale=0.4, size=(1, 22, 3)))
        p_hips = rng.normal(size=(1, 3)) + np.array([0.0, 1.0, 0.0])
        p_world, _ = forward_kinematics(R_local, p_hips, body.offsets)
        contact = rng.random((1, 2)) < 0.5
        source = np.full((1, 22), Source.IK, dtype=np.int8)
        roles = {role: RoleReport("ok", 0.01) for role in FOUR_POINTS}
        poses.append(
            SkeletonPose(3.0 + k / rate_hz, p_world, R_local, contact, contact, source, roles)
        )
    return poses
