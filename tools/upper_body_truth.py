"""How near is the upper body's IK to recorded people, who wear no tracker on chest and elbows?

    python tools/upper_body_truth.py PATH... [--part train] [--per-set 14] [--fit]

The clips' own hips, head and hands go in; what comes out is compared with their own joints.
--fit prints the table of elbow directions for lobstr_hw/ik/arms.py: fit on training people only.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lobstr_hw.ik.vectors import length, perpendicular, rotate, unit
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, geodesic_angle, transpose
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint
from lobstr_hw.splits import default_split
from lobstr_hw.upper_body import ARM_JOINTS, SPINE_JOINTS, pose_upper_body
from lobstr_hw.world_kinematics import positions

LONGEST_FRAMES = 45 * 40
HANDS = [Joint.LEFT_HAND, Joint.RIGHT_HAND]
ELBOWS = [Joint.LEFT_LOWER_ARM, Joint.RIGHT_LOWER_ARM]
ARM_M = 0.525

PULL = 0.01
"""Towards the elbow that hangs away from where the hand points: keeps rare poses sensible."""

ANCHOR_SHARE = 0.1
ANCHORS = (
    # hand from the upper arm (m), fingers, back of the hand, elbow: of a left arm, as few clips
    # have it: behind the head, overhead, on the head, behind the back, across, at the side
    ((-0.10, 0.18, -0.10), (-1, 0.3, -0.2), (0, 0.2, -1), (1, 0.1, 0.35)),
    ((-0.05, 0.22, -0.08), (-1, 0.5, -0.2), (0, 0.2, -1), (1, 0.1, 0.35)),
    ((0.0, 0.42, 0.05), (0, 1, 0.1), (0.3, 0, -1), (1, 0, 0.1)),
    ((-0.1, 0.40, 0.08), (-0.4, 1, 0.1), (0.3, 0, -1), (1, 0, 0.2)),
    ((-0.12, 0.28, 0.05), (-1, 0, 0.1), (0, 1, 0), (1, 0, 0.15)),
    ((-0.17, -0.37, -0.17), (-1, 0.1, 0), (0, 0, -1), (0.8, -0.1, -0.6)),
    ((-0.15, -0.25, -0.17), (-1, 0.5, 0), (0, 0, -1), (0.8, -0.2, -0.5)),
    ((-0.30, 0.02, 0.15), (-1, 0.2, -0.3), (0, 0.5, 1), (0.25, -1, 0.25)),
    ((-0.33, -0.20, 0.22), (-1, 0.2, 0.1), (0, 0, 1), (0.5, -1, 0.0)),
    ((0.50, 0.0, 0.0), (1, 0, 0), (0, 1, 0), (0, -0.15, -1)),
    ((0.05, -0.42, 0.02), (-0.3, -0.4, 0.8), (1, 0.1, 0.3), (0.8, 0, -0.6)),
    ((-0.05, 0.15, 0.05), (-0.2, 1, -0.2), (1, 0.2, 0), (0.6, -1, 0.3)),
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--part", help="of the project's own split; all clips without it")
    parser.add_argument("--per-set", type=int, default=14)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fit", action="store_true")
    args = parser.parse_args()
    names = None if args.part is None else default_split().parts[args.part]
    by_set: dict[str, list[Motion]] = {}
    for motion in chosen(args.paths, names, args.per_set, args.seed):
        by_set.setdefault(motion.name.split("/")[0], []).append(motion)
    people = {name: World(motions) for name, motions in sorted(by_set.items())}
    for name, world in people.items():
        print(f"{name:28s} {len(world.p) / 45 / 60:5.1f} min  {world.report()}")
    if args.fit:
        print(np.array2string(fit(list(people.values())), separator=", ", precision=2))
    return 0


def chosen(
    paths: list[Path], names: frozenset[str] | None, per_set: int, seed: int
) -> Iterator[Motion]:
    """So many clips of each set, drawn by lot."""
    by_set: dict[str, list[int]] = {}
    clips = find_clips(paths)
    for i, clip in enumerate(clips):
        if names is None or clip.name in names:
            by_set.setdefault(clip.set_name, []).append(i)
    rng = np.random.default_rng(seed)
    drawn = [i for members in by_set.values() for i in rng.permutation(members)[:per_set]]
    return retarget([clips[i] for i in drawn])


class World:
    """The truth of some clips, and the upper body that IK makes of their four points."""

    def __init__(self, motions: list[Motion]) -> None:
        joints = [motion.joints() for motion in motions]
        self.p = np.concatenate([p[:LONGEST_FRAMES] for p, _ in joints])
        self.R = np.concatenate([R[:LONGEST_FRAMES] for _, R in joints])
        p, R = self.p, self.R
        offsets = np.broadcast_to(STANDARD_OFFSETS, (len(p), 22, 3))
        spine, arm = pose_upper_body(
            p[:, 0], R[:, 0], p[:, Joint.HEAD], R[:, Joint.HEAD], p[:, HANDS], R[:, HANDS], offsets
        )
        self.R_ik = np.array(R)
        self.R_ik[:, SPINE_JOINTS] = spine
        self.R_ik[:, [joint for side in ARM_JOINTS for joint in side]] = arm.reshape(
            len(p), 6, 3, 3
        )
        self.p_ik = positions(self.R_ik, p[:, 0], offsets)

    def report(self) -> str:
        """Medians (95 in 100) in cm, the chest's turn in degrees, ends off by more than 1 cm."""
        off = 100.0 * np.linalg.norm(self.p_ik - self.p, axis=-1)
        turned = np.degrees(geodesic_angle(self.R_ik, self.R))[:, Joint.UPPER_CHEST]
        parts = {"elbow": ELBOWS, "upper chest": [Joint.UPPER_CHEST], "neck": [Joint.NECK]}
        said = [
            f"{k} {np.median(off[:, j]):.1f} ({np.percentile(off[:, j], 95):.1f})"
            for k, j in parts.items()
        ]
        missed = (off[:, [Joint.HEAD, *HANDS]] > 1.0).mean(axis=0)
        ends = f"head, hands off by 1 cm: {100 * missed[0]:.2f}, {100 * missed[1:].mean():.2f} %"
        return "  ".join([*said, f"chest {np.median(turned):.1f} deg", ends])

    def left_arms(self) -> tuple[Array, Array, Array]:
        """Hand and elbow from the upper arm, and the hand's rotation, right ones mirrored."""
        inverse = transpose(self.R_ik[:, [Joint.UPPER_CHEST]])
        p_arm = self.p_ik[:, [Joint.LEFT_UPPER_ARM, Joint.RIGHT_UPPER_ARM]]
        flip = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]])
        hand, elbow = (rotate(inverse, self.p[:, j] - p_arm) * flip for j in (HANDS, ELBOWS))
        R = (inverse @ self.R[:, HANDS]) * (flip[:, :, None] * flip[:, None, :])
        return hand.reshape(-1, 3), elbow.reshape(-1, 3), R.reshape(-1, 3, 3)


def fit(people: list[World]) -> Array:
    """Ridge regression of the elbow's direction across the line from shoulder to hand (10, 3).

    A sample counts by the square of how far the elbow stands off that line, each set the same.
    """
    rows: list[tuple[Array, Array, Array, Array]] = [_anchors()]
    for world in people:
        hand, elbow, R = world.left_arms()
        across = perpendicular(elbow, unit(hand))
        weight = length(across)[:, 0] ** 2 / len(hand)
        rows.append((_features(hand, R), unit(hand), unit(across), weight))
    total = sum(w.sum() for *_, w in rows[1:])
    H, g = np.zeros((10, 3, 10, 3)), np.zeros((10, 3))
    for X, axis, wanted, weight in rows:
        w = weight if X is rows[0][0] else weight / total
        P = np.eye(3) - axis[:, :, None] * axis[:, None, :]
        for a in range(3):
            for b in range(3):
                H[:, a, :, b] += X.T @ ((w * P[:, a, b])[:, None] * X)
        g += X.T @ (w[:, None] * wanted)
    prior = np.zeros((10, 3))
    prior[0], prior[4:7] = [0.3, -0.8, -0.6], -0.4 * np.eye(3)
    solved = np.linalg.solve(H.reshape(30, 30) + PULL * np.eye(30), (g + PULL * prior).reshape(30))
    return np.round(solved.reshape(10, 3), 2)


def _features(hand: Array, R: Array) -> Array:
    return np.concatenate([np.ones((len(hand), 1)), hand / ARM_M, R[:, :, 0], R[:, :, 1]], axis=1)


def _anchors() -> tuple[Array, Array, Array, Array]:
    hand, x, y, elbow = (np.array(v, dtype=float) for v in zip(*ANCHORS, strict=True))
    x = unit(x)
    y = unit(perpendicular(y, x))
    R = np.stack([x, y, np.cross(x, y)], axis=-1)
    axis = unit(hand)
    weight = np.full(len(hand), ANCHOR_SHARE / len(hand))
    return _features(hand, R), axis, unit(perpendicular(elbow, axis)), weight


if __name__ == "__main__":
    raise SystemExit(main())
