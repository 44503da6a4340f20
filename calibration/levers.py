"""Where the trackers sit on their joints, as a movement shows it: levers by pivot fit."""

import numpy as np

from lobstr_hw.calibration.measures import LeverPrior
from lobstr_hw.calibration.orientation import Place
from lobstr_hw.calibration.phases import Phases, angular_velocity, rate_of
from lobstr_hw.calibration.pivot import Pivot, fit_pivot, windows_of
from lobstr_hw.calibration.recording import RATE_HZ, Movement
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.proportions import eyes_in_head
from lobstr_hw.rotations import Array, heading_angle, transpose
from lobstr_hw.skeleton import STANDARD_OFFSETS, STATURE, Joint

__all__ = ["head_place", "levers_from_movement"]

HEAD, LEFT, RIGHT, PELVIS = range(4)
_WINDOW = round(0.4 * RATE_HZ)
_TURN_WINDOW = round(1.2 * RATE_HZ)
_HAND_REST_M = 0.009
_HEAD_REST_M = 0.003
_TURN_REST_M = 0.02
_BOW_REST_M = 0.015
_NECK = -0.33 * float(STANDARD_OFFSETS[Joint.HEAD, 1])
"""A nod is two thirds at the skull's base and a third at the neck's lower end: its pivot lies so
far below the skull's base (of a person of the mean stature)."""
_NECK_DEVIATION = np.array([0.003, 0.010, 0.006])
_SOCKETS = float(STANDARD_OFFSETS[Joint.LEFT_UPPER_LEG, 1])


def levers_from_movement(
    movement: Movement,
    p: Array,
    M: Array,
    phases: Phases,
    stature_m: float,
    hips_height_m: float,
    prior: LeverPrior,
) -> tuple[LeverPrior, dict[str, bool]]:
    """The prior, narrowed by the movement; and which parts of it had something to tell.

    Args:
        movement: of the trackers.
        p: (m, 4, 3) the joints, roughly.
        M: (4, 3, 3) R_joint_tracker.
        phases: what was done when.
        stature_m: roughly.
        hips_height_m: roughly.
        prior: in the joints' frames.
    """
    mean, deviation = np.array(prior.mean), np.array(prior.deviation)
    told = {}
    eyes = eyes_in_head(np.array(stature_m))
    neck = np.array([0.0, _NECK * stature_m / STATURE, 0.0])
    fits = (
        (HEAD, "head lever", eyes - neck, _NECK_DEVIATION, _head_windows(movement, phases)),
        (LEFT, "left wrist lever", np.zeros(3), np.zeros(3), _hand_windows(movement, p, LEFT)),
        (RIGHT, "right wrist lever", np.zeros(3), np.zeros(3), _hand_windows(movement, p, RIGHT)),
    )
    for joint, name, shift, blur, windows in fits:
        told[name] = bool(windows)
        if windows:
            noise = _HEAD_REST_M if joint == HEAD else _HAND_REST_M
            wide = np.diag(prior.deviation[joint] ** 2 + blur**2)
            pivot = _fitted(movement, joint, M, prior.mean[joint] + shift, wide, windows, noise)
            mean[joint], covariance = _in_joint(pivot, M[joint])
            mean[joint] -= shift
            # the pivot's place in the head stays as unsure as it is
            own = np.minimum(np.diag(covariance) + blur**2, prior.deviation[joint] ** 2)
            deviation[joint] = np.sqrt(own)
    told |= _hips(movement, M, phases, hips_height_m, mean, deviation)
    return LeverPrior(prior.held, mean, deviation), told


def head_place(
    movement: Movement, M: Array, phases: Phases, stature_m: float, prior: LeverPrior
) -> list[Place]:
    """Where a nod has its pivot: eyes and neck lie in one plane, which tells how a headset sits."""
    windows = _head_windows(movement, phases)
    if not windows:
        return []
    neck = np.array([0.0, _NECK * stature_m / STATURE, 0.0])
    expected = prior.mean[HEAD] + eyes_in_head(np.array(stature_m)) - neck
    vague = np.eye(3) * 0.1**2  # the movement alone: what is expected is counted once, there
    pivot = _fitted(movement, HEAD, M, expected, vague, windows, _HEAD_REST_M)
    lever, covariance = _in_joint(pivot, M[HEAD])
    known = np.diag(prior.deviation[HEAD] ** 2 + _NECK_DEVIATION**2)
    return [Place(HEAD, expected, M[HEAD].T @ lever, covariance + known)]


def _fitted(
    movement: Movement,
    joint: int,
    M: Array,
    lever: Array,
    covariance: Array,
    windows: list[slice],
    noise_m: float,
    rows: Array | None = None,
    order: int = 1,
) -> Pivot:
    """The pivot for a lever (3,) from joint to tracker, in the joint's frame."""
    R = M[joint]
    return fit_pivot(
        movement.p[:, joint],
        movement.R[:, joint],
        windows,
        -R.T @ lever,
        R.T @ covariance @ R,
        noise_m=noise_m,
        rows=rows,
        order=order,
    )


def _in_joint(pivot: Pivot, M: Array) -> tuple[Array, Array]:
    """Lever from joint to tracker and its covariance, in the joint's frame."""
    return -M @ pivot.p, M @ pivot.covariance @ M.T


def _fast(R: Array, least_deg_s: float) -> Bools:
    """Turning about now: the reversals of a wave belong to it."""
    fast = np.linalg.norm(angular_velocity(R, RATE_HZ), axis=-1) > np.deg2rad(least_deg_s)
    reach = round(0.12 * RATE_HZ)
    wide = np.convolve(fast, np.ones(2 * reach + 1), mode="same") > 0.0
    return np.asarray(wide)


def _head_windows(movement: Movement, phases: Phases) -> list[slice]:
    tracked = movement.tracked[:, HEAD]
    chosen = phases.still & tracked & _fast(movement.R[:, HEAD], 25.0)
    return windows_of(chosen, _WINDOW)


def _hand_windows(movement: Movement, p: Array, joint: int) -> list[slice]:
    speed = np.linalg.norm(rate_of(p[:, joint], RATE_HZ, 0.2), axis=-1)
    chosen = _fast(movement.R[:, joint], 50.0) & movement.tracked[:, joint] & (speed < 0.5)
    return windows_of(chosen, _WINDOW)


def _hips(
    movement: Movement,
    M: Array,
    phases: Phases,
    hips_height_m: float,
    mean: Array,
    deviation: Array,
) -> dict[str, bool]:
    """Sideways and forward by the turn, forward by the bow; overwrites the pelvis' rows."""
    tracked = movement.tracked[:, PELVIS]
    turns = windows_of(phases.turning & tracked, _TURN_WINDOW)
    yaw = np.unwrap(heading_angle(movement.R[:, PELVIS] @ M[PELVIS].T)[0])
    turns = [w for w in turns if abs(yaw[w.stop - 1] - yaw[w.start]) > np.deg2rad(60.0)]
    covariance = np.diag(deviation[PELVIS] ** 2)
    if turns:
        level = np.eye(3)[[0, 2]]
        pivot = _fitted(movement, PELVIS, M, mean[PELVIS], covariance, turns, _TURN_REST_M, level)
        mean[PELVIS], covariance = _in_joint(pivot, M[PELVIS])
    bows = _bows(movement, M, phases)
    if bows:
        # who bows with straight legs turns about the hip sockets, which stay at their height
        down = np.array([0.0, _SOCKETS * hips_height_m, 0.0])
        height = np.eye(3)[[1]]
        pivot = _fitted(
            movement, PELVIS, M, mean[PELVIS] - down, covariance, bows, _BOW_REST_M, height, 0
        )
        mean[PELVIS], covariance = _in_joint(pivot, M[PELVIS])
        mean[PELVIS] += down
    deviation[PELVIS] = np.sqrt(np.diag(covariance))
    return {"turn on the spot": bool(turns), "bow": bool(bows)}


def _bows(movement: Movement, M: Array, phases: Phases) -> list[slice]:
    chosen = phases.bowing & movement.tracked[:, PELVIS]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    R = movement.R[:, PELVIS] @ transpose(M[PELVIS])
    pitch = np.arctan2(-R[:, 1, 2], R[:, 1, 1])
    found = []
    for start, end in edges.reshape(-1, 2):
        window = slice(max(0, start - 10), min(len(movement), end + 10))
        if np.ptp(pitch[window]) > np.deg2rad(10.0):
            found.append(window)
    return found
