"""Clips of the standard skeleton put one after another, with a step between them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.rotations import Array, heading, slerp, transpose
from lobstr_hw.simulation.legs import LEGS, plant, rotations_to_ankles
from lobstr_hw.skeleton import forward_kinematics, local_rotations

__all__ = ["eased", "joined", "moved"]

_EASE_S = 0.6  # from rest to full speed
_STEP_S = 1.2  # both feet, one after the other
_LIFT_M = 0.06
_BEND_M = 0.03  # who steps bends the knees a little
_FEET = LEGS[:, 2]


def joined(motions: Sequence[Motion], step_s: float = _STEP_S) -> Motion:
    """All motions in one, each begun where the last ended, at rest in between.

    Every motion starts and ends by :func:`eased`; in between the person steps from the last pose
    into the next, one foot after the other, so that a foot on the floor does not slide.

    Args:
        motions: all at one rate.
        step_s: how long the steps between two of them take.

    Raises:
        ValueError: rates differ.
    """
    if len({m.rate_hz for m in motions}) != 1:
        raise ValueError(f"rates differ: {[m.rate_hz for m in motions]}")
    last = len(motions) - 1
    whole = eased(motions[0], start=False, end=last > 0)
    for i, motion in enumerate(motions[1:], start=1):
        part = moved(eased(motion, start=True, end=i < last), *_onto(motion, whole))
        whole = _chained(whole, _steps(whole, part, round(step_s * whole.rate_hz)), part)
    return whole


def moved(motion: Motion, R: Array, p: Array) -> Motion:
    """The same motion turned by R (3, 3) and then shifted by p (3,)."""
    R_local = np.array(motion.R_local)
    R_local[:, 0] = R @ R_local[:, 0]
    return replace(
        motion,
        p_hips=motion.p_hips @ R.T + p,
        R_local=R_local,
        p_toes=motion.p_toes @ R.T + p,
    )


def eased(motion: Motion, *, start: bool = True, end: bool = False) -> Motion:
    """The same way in space, with the clock running up from rest (and down to it).

    The clock's speed is a smooth step over 0.6 s, in which 0.3 s of the motion pass; all other
    frames stay what they are.
    """
    half = min(round(_EASE_S / 2.0 * motion.rate_hz), (len(motion) - 1) // 2)
    k = np.arange(2 * half) / max(2 * half, 1)
    ramp = 2 * half * (k**3 - k**4 / 2.0)  # the integral of 3 k^2 - 2 k^3
    first = ramp if start else np.arange(half)
    final = len(motion) - 1
    closing = final - (ramp[::-1] if end else np.arange(half)[::-1])
    return _at_frames(motion, np.concatenate([first, np.arange(half, final - half + 1), closing]))


def _at_frames(motion: Motion, at: Array) -> Motion:
    i = np.minimum(at.astype(int), len(motion) - 1)
    j = np.minimum(i + 1, len(motion) - 1)
    f = at - i

    def between(values: Array) -> Array:
        w = f.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray((1.0 - w) * values[i] + w * values[j])

    R_local = np.array(motion.R_local[i])
    odd = f > 0.0  # most frames are whole ones, and slerp is dear
    R_local[odd] = slerp(motion.R_local[i[odd]], motion.R_local[j[odd]], f[odd, None])
    return replace(
        motion, p_hips=between(motion.p_hips), R_local=R_local, p_toes=between(motion.p_toes)
    )


def _onto(motion: Motion, before: Motion) -> tuple[Array, Array]:
    """The move that starts ``motion`` at the heading and place where ``before`` ends."""
    R = heading(before.R_local[-1, 0]) @ transpose(heading(motion.R_local[0, 0]))
    level = np.array([1.0, 0.0, 1.0])
    return R, np.asarray((before.p_hips[-1] - R @ motion.p_hips[0]) * level)


def _minimum_jerk(t: Array) -> Array:
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t**2))


def _steps(before: Motion, after: Motion, n: int) -> Motion:
    """The n - 1 frames between the last of one motion and the first of the next."""
    R_local = np.stack([before.R_local[-1], after.R_local[0]])  # (2, 22, 3, 3) the two ends
    p_hips = np.stack([before.p_hips[-1], after.p_hips[0]])
    p, R = forward_kinematics(R_local, p_hips)
    t = np.arange(n + 1) / n
    w = _minimum_jerk(t)
    feet_w = _minimum_jerk(2.0 * t[:, None] - np.array([0.0, 1.0]))  # (n + 1, 2) left, then right
    distance = np.linalg.norm(p[1, _FEET] - p[0, _FEET], axis=-1)
    lift = _LIFT_M * np.minimum(distance / 0.2, 1.0) * np.sin(np.pi * feet_w) ** 2
    ankles = p[0, _FEET] + feet_w[..., None] * (p[1, _FEET] - p[0, _FEET])
    ankles[..., 1] += lift
    out = slerp(R_local[0], R_local[1], w[:, None])
    bend = _BEND_M * np.sin(np.pi * t) ** 2
    hips = plant(p_hips[0] + w[:, None] * (p_hips[1] - p_hips[0]), out[:, 0], ankles, bend)
    world = forward_kinematics(out, hips)[1]
    world[:, LEGS[:, :2]] = _legs(hips, out[:, 0], ankles, R[:, LEGS[:, :2]], w)
    world[:, _FEET] = slerp(R[0, _FEET], R[1, _FEET], feet_w)
    world[:, LEGS[:, 3]] = world[:, _FEET] @ out[:, LEGS[:, 3]]
    out = local_rotations(world)
    p_toes = forward_kinematics(out, hips)[0][:, LEGS[:, 3]]
    return replace(before, p_hips=hips[1:-1], R_local=out[1:-1], p_toes=p_toes[1:-1])


def _legs(p_hips: Array, R_hips: Array, p_ankles: Array, ends: Array, w: Array) -> Array:
    """Upper and lower legs (n, 2, 2, 3, 3) that are the ends' own (2, 2, 2, 3, 3) at w = 0 and 1.

    What the solver leaves out (a knee out of the plane, a twist) is blended from end to end.
    """
    like = slerp(ends[0], ends[1], w[:, None, None])
    solved = rotations_to_ankles(p_hips, R_hips, p_ankles, like)
    left_out = transpose(solved[[0, -1]]) @ ends
    return np.asarray(solved @ slerp(left_out[0], left_out[1], w[:, None, None]))


def _chained(*parts: Motion) -> Motion:
    return replace(
        parts[0],
        name="+".join(dict.fromkeys(part.name for part in parts)),
        p_hips=np.concatenate([part.p_hips for part in parts]),
        R_local=np.concatenate([part.R_local for part in parts]),
        p_toes=np.concatenate([part.p_toes for part in parts]),
    )
