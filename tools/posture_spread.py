"""How differently one person holds pelvis and head from clip to clip, upright and walking.

    python tools/posture_spread.py FOLDER ... [--part train]

The simulated people of lobstr_hw/simulation/movement.py are drawn after these figures
(docs/calibration.md). Spread: 1.48 times the median absolute deviation over a subject's clips.
"""

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, heading, heading_angle, transpose
from lobstr_hw.skeleton import Joint
from lobstr_hw.splits import default_split

LEAST_CLIPS = 5
LEAST_S = 1.5
NAMES = ("pelvis pitch", "roll", "head pitch", "roll", "pelvis yaw to the way", "head yaw to it")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--part", default="train")
    args = parser.parse_args()
    split = default_split()
    clips = [
        clip
        for clip in find_clips(args.folders)
        if split.part_of(f"{clip.set_name}/{clip.clip}") == args.part
    ]
    found: dict[str, list[Array]] = defaultdict(list)
    for motion in retarget(clips):
        found[motion.subject].append(np.array([*_upright(motion), *_walking(motion)]))
    print("| subject | clips | " + " | ".join(NAMES) + " |")
    print("|---|---|" + "---|" * len(NAMES))
    for subject, rows in found.items():
        table = np.array(rows)
        if np.sum(np.isfinite(table[:, 0])) >= LEAST_CLIPS:
            spread = 1.48 * np.nanmedian(np.abs(table - np.nanmedian(table, axis=0)), axis=0)
            print(f"| {subject} | {len(rows)} | " + " | ".join(f"{v:.1f}" for v in spread) + " |")
    return 0


def _upright(motion: Motion) -> list[float]:
    """Median pitch and roll of pelvis and head, degrees, while the head is high."""
    p, R = motion.joints()
    high = p[:, Joint.HEAD, 1] > 0.97 * np.percentile(p[:, Joint.HEAD, 1], 90.0)
    if np.sum(high) < LEAST_S * motion.rate_hz:
        return [float("nan")] * 4
    out = []
    for joint in (Joint.HIPS, Joint.HEAD):
        level = (transpose(heading(R[high, joint])) @ R[high, joint])[:, :, 1]
        out += [
            float(np.rad2deg(np.median(np.arctan2(level[:, axis], level[:, 1])))) for axis in (2, 0)
        ]
    return out


def _walking(motion: Motion) -> list[float]:
    """Median yaw of pelvis and head to where the hips go, degrees, walking straight ahead."""
    p, R = motion.joints()
    k = round(0.8 * motion.rate_hz)
    if len(p) <= 2 * k:
        return [float("nan")] * 2
    way = p[k:, Joint.HIPS] - p[:-k, Joint.HIPS]
    course = np.arctan2(way[:, 0], way[:, 2])
    speed = np.hypot(way[:, 0], way[:, 2]) * motion.rate_hz / k
    yaw = np.stack([heading_angle(R[:, joint])[0] for joint in (Joint.HIPS, Joint.HEAD)], axis=1)
    turned = np.abs(_turn(yaw[k:, 0] - yaw[:-k, 0]))
    off = _turn(yaw[k // 2 : k // 2 + len(course)] - course[:, None])
    straight = (speed > 0.6) & (turned < np.deg2rad(12.0)) & (np.abs(off[:, 0]) < 0.5)
    if np.sum(straight) < LEAST_S * motion.rate_hz:
        return [float("nan")] * 2
    return [float(v) for v in np.rad2deg(np.median(off[straight], axis=0))]


def _turn(angle: Array) -> Array:
    return np.asarray(np.angle(np.exp(1j * angle)))


if __name__ == "__main__":
    raise SystemExit(main())
