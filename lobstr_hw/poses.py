"""A pose: rotation and translation of one frame in another (docs/conventions.md)."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.rotations import Array, transpose

__all__ = ["PartialPose", "Pose"]


def frozen(values: Array, shape: tuple[int, ...]) -> Array:
    """A float64 copy nobody can write to, whose trailing axes have ``shape``."""
    out = np.array(values, dtype=np.float64)
    if out.shape[-len(shape) :] != shape:
        raise ValueError(f"expected (..., {', '.join(map(str, shape))}), got {out.shape}")
    out.setflags(write=False)
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """``T_a_b`` takes coordinates in b to a. Neighbours cancel: ``T_a_c = T_a_b @ T_b_c``.

    Attributes:
        R: rotation (..., 3, 3).
        p: origin of b in a (..., 3), metres.
    """

    R: Array
    p: Array

    def __post_init__(self) -> None:
        """Check the shapes once, so that inner code can trust the type."""
        object.__setattr__(self, "R", frozen(self.R, (3, 3)))
        object.__setattr__(self, "p", frozen(self.p, (3,)))

    @staticmethod
    def identity() -> "Pose":
        """The pose of a frame in itself."""
        return Pose(np.eye(3), np.zeros(3))

    def __matmul__(self, other: "Pose") -> "Pose":
        """Chain two poses."""
        return Pose(self.R @ other.R, self.apply(other.p))

    def apply(self, points: Array) -> Array:
        """Points (..., 3) of b in a."""
        return np.asarray((self.R @ points[..., None])[..., 0] + self.p)

    def inverse(self) -> "Pose":
        """``T_b_a``."""
        R = transpose(self.R)
        return Pose(R, -(R @ self.p[..., None])[..., 0])


@dataclass(frozen=True, slots=True, eq=False)
class PartialPose:
    """A pose whose position may be unknown: an IMU knows how it turns, not where it is."""

    R: Array
    p: Array | None

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "R", frozen(self.R, (3, 3)))
        if self.p is not None:
            object.__setattr__(self, "p", frozen(self.p, (3,)))
