"""Small vector and rotation tools for inverse kinematics, spelt out because one call must be cheap.

A tick poses one body: every NumPy call costs about a microsecond whatever it does, ``np.cross`` and
``np.linalg.norm`` cost ten times that, so the few products that IK lives on are written by hand.
All functions take any number of leading batch axes.
"""

import numpy as np

from lobstr_hw.rotations import Array

__all__ = [
    "align",
    "cross",
    "dot",
    "faded_angle",
    "length",
    "log_rotation",
    "perpendicular",
    "rotate",
    "sine_axis",
    "smoothstep",
    "swing",
    "turn",
    "twist_terms",
    "unit",
]

_EYE = np.eye(3)
_NEXT = np.array([1, 2, 0])
_LAST = np.array([2, 0, 1])
_TINY = 1e-12

# the cross matrix of v is v @ _LEVI_CIVITA, reshaped to 3 x 3
_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_j, _i, _k], _LEVI_CIVITA[_j, _k, _i] = 1.0, -1.0
_CROSS = _LEVI_CIVITA.reshape(3, 9)
_VEE_TO = np.array([2, 0, 1]), np.array([1, 2, 0])


def cross(a: Array, b: Array) -> Array:
    """Vector product a x b of vectors (..., 3)."""
    return np.asarray(a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT])


def dot(a: Array, b: Array) -> Array:
    """Scalar product a . b with the last axis kept: (..., 1)."""
    return np.asarray(np.add.reduce(a * b, axis=-1, keepdims=True))


def length(v: Array) -> Array:
    """Of vectors (..., 3), the last axis kept: (..., 1)."""
    return np.asarray(np.sqrt(np.add.reduce(v * v, axis=-1, keepdims=True)))


def unit(v: Array) -> Array:
    """Vectors (..., 3) at length 1; a zero vector stays zero."""
    return np.asarray(v / np.maximum(length(v), _TINY))


def rotate(R: Array, v: Array) -> Array:
    """R v for matrices (..., 3, 3) and vectors (..., 3)."""
    return np.asarray((R @ v[..., None])[..., 0])


def perpendicular(v: Array, axis: Array) -> Array:
    """The part of v (..., 3) that is at right angles to the unit vector ``axis``."""
    return np.asarray(v - dot(v, axis) * axis)


def smoothstep(x: Array, start: float, end: float) -> Array:
    """0 up to ``start``, 1 from ``end`` on (which may be the smaller), smooth between."""
    t = np.minimum(np.maximum((x - start) / (end - start), 0.0), 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _cross_matrix(v: Array) -> Array:
    return np.asarray((v @ _CROSS).reshape(*v.shape, 3))


def turn(w: Array) -> Array:
    """Rotation vectors (..., 3) -> matrices (..., 3, 3), exact also for very small turns."""
    angle = np.maximum(length(w), 1e-30)[..., None]
    K = _cross_matrix(w)
    # Rodrigues with sin(a)/a and (1 - cos(a))/a^2 = (sin(a/2)/(a/2))^2 / 2
    half = 0.5 * angle
    a, b = np.sin(angle) / angle, np.sin(half) / half
    return np.asarray(_EYE + a * K + (0.5 * b * b) * (K @ K))


def swing(a: Array, b: Array) -> Array:
    """The shortest rotation from unit vectors a to b (..., 3); b = -a gives some half turn.

    R = I + K + K K / (1 + a.b) with K the cross matrix of a x b; the denominator is kept from zero.
    """
    K = _cross_matrix(cross(a, b))
    c = dot(a, b)[..., None]
    return np.asarray(_EYE + K + (K @ K) / np.maximum(1.0 + c, _TINY))


def sine_axis(R: Array) -> Array:
    """The axis of R (..., 3, 3) times the SINE of its angle (..., 3).

    Continuous for every rotation, unlike the rotation vector, which jumps at half a turn.
    """
    i, j = _VEE_TO
    return np.asarray(0.5 * (R[..., i, j] - R[..., j, i]))


def log_rotation(R: Array) -> Array:
    """Rotation vector (..., 3) of turns well below half a turn (successive poses)."""
    a = sine_axis(R)
    sine = length(a)
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1.0)[..., None]
    factor = np.where(sine > 1e-9, np.arctan2(sine, cosine) / np.maximum(sine, 1e-9), 1.0)
    return np.asarray(a * factor)


def twist_terms(R: Array, axis: int) -> tuple[Array, Array]:
    """Sine and cosine terms (...) of the turn of R about a coordinate axis (swing-twist)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    return R[..., j, i] - R[..., i, j], R[..., i, i] + R[..., j, j]


def faded_angle(s: Array, c: Array, full_until: float = 2.2) -> Array:
    """The angle atan2(s, c) (...), taken back to zero where it would jump.

    Beyond ``full_until`` it falls smoothly to zero at half a turn, and it fades where both terms
    are small (the swing is then a half turn itself): what follows from it can never snap.
    """
    angle = np.arctan2(s, c)
    keep = smoothstep(np.abs(angle), np.pi, full_until)
    return np.asarray(angle * keep * smoothstep(np.hypot(s, c), 0.0, 0.5))


def align(bone: Array, hinge: Array, to_bone: Array, to_hinge: Array) -> Array:
    """The rotation that takes ``bone`` exactly to ``to_bone`` and ``hinge`` as near as can be.

    Args:
        bone: a direction (..., 3) in the joint's own frame.
        hinge: another, not parallel to it.
        to_bone: unit vector in the world.
        to_hinge: direction in the world.
    """
    return np.asarray(_frame(to_bone, to_hinge) @ np.swapaxes(_frame(unit(bone), hinge), -1, -2))


def _frame(x: Array, towards: Array) -> Array:
    z = unit(cross(x, towards))
    return np.stack([x, cross(z, x), z], axis=-1)
