"""Rotations as 3x3 matrices, with any number of leading batch axes (docs/conventions.md).

Column vectors: ``v_world = R_world_joint @ v_joint``. Angles are in radians. The 6D rotation is the
paper's pair of axes, forward (Z) then up (Y), six numbers in a row (design of Zhou et al. 2019).
Quaternions exist at the edges only and carry their order in the name.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

__all__ = [
    "Array",
    "angle_between",
    "from_6d",
    "from_axis_angle",
    "from_euler",
    "from_quat_xyzw",
    "from_rotation_vector",
    "geodesic_angle",
    "heading",
    "heading_angle",
    "rotation_between",
    "rotation_mean",
    "rotation_x",
    "rotation_y",
    "rotation_z",
    "slerp",
    "to_6d",
    "to_euler",
    "to_quat_xyzw",
    "to_rotation_vector",
    "transpose",
]

_YZXY = np.array([1, 2, 0, 1])
"""A vector's numbers so that the first three are y, z, x and the last three z, x, y."""
_TINY = np.finfo(np.float64).tiny
HEADING_MINIMUM = 0.2
"""Under this the pelvis is too close to upside down for its heading to be told."""


def transpose(R: Array) -> Array:
    """The inverse of a rotation (..., 3, 3)."""
    return np.swapaxes(R, -1, -2)


def normalize(v: Array) -> Array:
    """Vectors (..., 3) at length 1; a zero vector stays zero."""
    # in the predictor's step np.linalg.norm takes three times as long
    length = np.sqrt(np.einsum("...i,...i->...", v, v))[..., None]
    return np.asarray(v / np.maximum(length, _TINY))


def to_6d(R: Array) -> Array:
    """Matrix (..., 3, 3) -> Z axis, then Y axis (..., 6)."""
    return np.concatenate([R[..., :, 2], R[..., :, 1]], axis=-1)


def from_6d(r6: Array) -> Array:
    """Six numbers (..., 6) -> the nearest matrix that keeps the direction of Z (Zhou et al.)."""
    z = normalize(r6[..., :3])
    y = r6[..., 3:]
    y = normalize(y - np.einsum("...i,...i->...", y, z)[..., None] * z)
    # written out: in the predictor's step np.cross takes as long as the network
    y_turned, z_turned = y[..., _YZXY], z[..., _YZXY]
    x = y_turned[..., :3] * z_turned[..., 1:] - y_turned[..., 1:] * z_turned[..., :3]
    return np.stack([x, y, z], axis=-1)


def from_axis_angle(axis: Array, angle: Array | float) -> Array:
    """Turn by ``angle`` (...) radians about unit vectors ``axis`` (..., 3)."""
    a = np.asarray(angle, dtype=np.float64)[..., None, None]
    K = _cross_matrix(np.asarray(axis, dtype=np.float64))
    # Rodrigues' formula
    return np.asarray(np.eye(3) + np.sin(a) * K + (1.0 - np.cos(a)) * (K @ K))


def _cross_matrix(v: Array) -> Array:
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    o = np.zeros_like(x)
    rows = [np.stack(r, axis=-1) for r in ((o, -z, y), (z, o, -x), (-y, x, o))]
    return np.stack(rows, axis=-2)


def rotation_x(angle: Array | float) -> Array:
    """Turn about X by (...) radians."""
    return from_axis_angle(np.array([1.0, 0.0, 0.0]), angle)


def rotation_y(angle: Array | float) -> Array:
    """Turn about Y by (...) radians."""
    a = np.asarray(angle, dtype=np.float64)
    R = np.zeros((*a.shape, 3, 3))
    R[..., 1, 1] = 1.0
    R[..., 0, 0] = R[..., 2, 2] = np.cos(a)
    R[..., 0, 2] = np.sin(a)
    R[..., 2, 0] = -R[..., 0, 2]
    return R


def rotation_z(angle: Array | float) -> Array:
    """Turn about Z by (...) radians."""
    return from_axis_angle(np.array([0.0, 0.0, 1.0]), angle)


def from_rotation_vector(w: Array) -> Array:
    """Exponential map: axis times angle (..., 3) -> matrix."""
    angle = np.linalg.norm(w, axis=-1)
    return from_axis_angle(normalize(w), angle)


def to_rotation_vector(R: Array) -> Array:
    """Logarithm: matrix -> axis times angle (..., 3), the angle in [0, pi]."""
    q = to_quat_xyzw(R)  # w >= 0
    v, w = q[..., :3], q[..., 3]
    s = np.linalg.norm(v, axis=-1)
    angle = 2.0 * np.arctan2(s, w)
    small = s < 1e-12
    factor = np.where(small, 2.0, angle / np.where(small, 1.0, s))
    return np.asarray(v * factor[..., None])


def geodesic_angle(A: Array, B: Array) -> Array:
    """Angle (...) of the turn from A to B, accurate for small and for large turns."""
    # |A - B|_F = 2 sqrt(2) sin(angle / 2)
    half_sine = np.linalg.norm(A - B, axis=(-2, -1)) / (2.0 * np.sqrt(2.0))
    return np.asarray(2.0 * np.arcsin(np.clip(half_sine, 0.0, 1.0)))


def angle_between(a: Array, b: Array) -> Array:
    """Angle (...) between vectors (..., 3)."""
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.arctan2(cross, np.sum(a * b, axis=-1)))


def slerp(A: Array, B: Array, t: Array | float) -> Array:
    """The rotation at fraction ``t`` (...) of the shortest way from A to B."""
    t = np.asarray(t, dtype=np.float64)
    D = transpose(A) @ B
    twice_cosine = D[..., 0, 0] + D[..., 1, 1] + D[..., 2, 2] - 1.0
    if np.any(twice_cosine < -1.9):  # near half a turn the axis takes more care
        return np.asarray(A @ from_rotation_vector(to_rotation_vector(D) * t[..., None]))
    # without quaternions: this runs in every tick, and is 3.5 times as fast
    v = np.stack([D[..., i, j] - D[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=-1)
    twice_sine = np.sqrt(np.einsum("...i,...i", v, v))
    axis = v / np.where(twice_sine > 0.0, twice_sine, 1.0)[..., None]
    return np.asarray(A @ from_axis_angle(axis, np.arctan2(twice_sine, twice_cosine) * t))


def rotation_between(a: Array, b: Array) -> Array:
    """The shortest rotation that takes direction ``a`` (..., 3) to ``b``."""
    a, b = normalize(a), normalize(b)
    cross = np.cross(a, b)
    opposite = np.linalg.norm(a + b, axis=-1) < 1e-9
    axis = np.where(opposite[..., None], _any_perpendicular(a), cross)
    return from_axis_angle(normalize(axis), angle_between(a, b))


def _any_perpendicular(v: Array) -> Array:
    least = np.argmin(np.abs(v), axis=-1)
    return normalize(np.cross(v, np.eye(3)[least]))


def rotation_mean(R: Array, axis: int = 0) -> Array:
    """The rotation nearest to many (least squares over one batch axis)."""
    U, _, Vt = np.linalg.svd(np.mean(R, axis=axis))
    U[..., :, -1] *= np.linalg.det(U @ Vt)[..., None]
    return np.asarray(U @ Vt)


def heading_angle(R: Array) -> tuple[Array, Array]:
    """Yaw of a rotation by swing-twist about Y, and how well it is defined.

    Returns:
        yaw (...) in radians, and the hypotenuse (...) of its two terms; under
        :data:`HEADING_MINIMUM` the last good heading should be kept.
    """
    s = R[..., 0, 2] - R[..., 2, 0]
    c = R[..., 0, 0] + R[..., 2, 2]
    return np.arctan2(s, c), np.hypot(s, c)


def heading(R: Array, last: Array | None = None) -> Array:
    """The turn about the vertical nearest to R: the paper's reference frame.

    Args:
        R: hips in the world (..., 3, 3).
        last: heading (..., 3, 3) to keep where R has none.
    """
    yaw, certainty = heading_angle(R)
    R_ref = rotation_y(yaw)
    if last is None:
        return R_ref
    return np.where((certainty < HEADING_MINIMUM)[..., None, None], last, R_ref)


def to_quat_xyzw(R: Array) -> Array:
    """Matrix -> unit quaternion x, y, z, w with w >= 0."""
    m = R
    t = np.stack(  # four times the square of each component; the largest is the safe one
        [
            1.0 + m[..., 0, 0] - m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] + m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] - m[..., 1, 1] + m[..., 2, 2],
            1.0 + m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2],
        ],
        axis=-1,
    )
    xy, xz, yz = (
        m[..., 0, 1] + m[..., 1, 0],
        m[..., 0, 2] + m[..., 2, 0],
        m[..., 1, 2] + m[..., 2, 1],
    )
    wx, wy, wz = (
        m[..., 2, 1] - m[..., 1, 2],
        m[..., 0, 2] - m[..., 2, 0],
        m[..., 1, 0] - m[..., 0, 1],
    )
    rows = np.stack(
        [
            np.stack([t[..., 0], xy, xz, wx], axis=-1),
            np.stack([xy, t[..., 1], yz, wy], axis=-1),
            np.stack([xz, yz, t[..., 2], wz], axis=-1),
            np.stack([wx, wy, wz, t[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(t, axis=-1)
    q = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., 3:] < 0.0, -q, q))


def from_quat_xyzw(q: Array) -> Array:
    """Quaternion x, y, z, w (any length but zero) -> matrix."""
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    v, w = q[..., :3], q[..., 3, None, None]
    K = _cross_matrix(v)
    return np.asarray(np.eye(3) + 2.0 * (w * K + K @ K))


_ABOUT = {"X": rotation_x, "Y": rotation_y, "Z": rotation_z}


def from_euler(order: str, angles: Array) -> Array:
    """Intrinsic turns, as BVH has them: ``from_euler("ZXY", (z, x, y)) = Rz @ Rx @ Ry``."""
    R = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for i, axis in enumerate(order):
        R = R @ _ABOUT[axis](angles[..., i])
    return np.asarray(R)


def to_euler(order: str, R: Array) -> Array:
    """The intrinsic angles (..., 3) of three different axes, the middle one within 90 degrees."""
    i, j, k = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    middle = np.arcsin(np.clip(sign * R[..., i, k], -1.0, 1.0))
    first = np.arctan2(-sign * R[..., j, k], R[..., k, k])
    last = np.arctan2(-sign * R[..., i, j], R[..., i, i])
    # gimbal lock: only the sum is known, so all of it goes to the first angle
    locked = np.hypot(R[..., i, i], R[..., i, j]) < 1e-9
    first = np.where(locked, np.arctan2(sign * R[..., k, j], R[..., j, j]), first)
    return np.stack([first, middle, np.where(locked, 0.0, last)], axis=-1)
