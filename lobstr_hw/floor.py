"""No heel, ball or toe tip goes under the floor (y = 0)."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.ik.vectors import length, rotate, swing, unit
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import HEEL, STANDARD_OFFSETS, TOE_BASE_HEIGHT, TOE_TIP, Body, Joint

__all__ = ["FootShape", "above_floor", "raised", "toes_on_floor"]

FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]


@dataclass(frozen=True, slots=True, eq=False)
class FootShape:
    """Where a foot touches the floor.

    The ball is a ball: the toe base is never lower than ``ball_m``, however the foot is pitched,
    and the toe tip never lower than ``tip_m``; both stand so high in flat stance.

    Attributes:
        heel: of the sole, seen from the toe base, in the foot's frame (n, 2, 3).
        tip: of the toes, in the toes' frame (n, 2, 3).
        ball_m: (n, 1) least height of the toe base.
        tip_m: (n, 1) least height of the tip.
    """

    heel: Array
    tip: Array
    ball_m: Array
    tip_m: Array

    @staticmethod
    def of(body: Body) -> "FootShape":
        """The standard foot, scaled by the body's own from ankle to toe base."""
        toes = body.offsets[:, TOES]  # (n, 2, 3)
        size = length(toes) / length(STANDARD_OFFSETS[Joint.LEFT_TOES])
        sole = body.sole[:, None]
        heel_y = toes[..., 1] - sole  # in flat stance the heel stands on the floor
        heel = np.stack([0.0 * heel_y, heel_y, size[..., 0] * HEEL[2]], axis=-1)
        tip = size * TOE_TIP
        tip_m = sole * (TOE_BASE_HEIGHT + TOE_TIP[1]) / TOE_BASE_HEIGHT
        tip[..., 1] = tip_m - sole
        return FootShape(heel - toes, tip, sole, tip_m)


def raised(v: Array, least_y: Array, sideways: Array) -> Array:
    """The smallest turn (..., 3, 3) that brings the tip of ``v`` up to a height.

    Args:
        v: lever (..., 3), world.
        least_y: (...) height wanted at least, from the root of v.
        sideways: (..., 3) a direction for levers that point straight down.
    """
    reach = length(v)[..., 0]
    y = np.maximum(v[..., 1], np.minimum(least_y, reach))
    flat = v + 1e-6 * sideways
    flat = unit(np.stack([flat[..., 0], np.zeros_like(y), flat[..., 2]], axis=-1))
    across = np.sqrt(np.maximum(reach**2 - y**2, 0.0))
    wanted = flat * across[..., None]
    wanted[..., 1] = y
    low = v[..., 1] < least_y
    return swing(unit(v), unit(np.where(low[..., None], wanted, v)))


def above_floor(toe: Array, R_foot: Array, shape: FootShape) -> tuple[Array, Array]:
    """Toe base and foot as near as can be to those given, the heel not under the floor.

    The toe base is lifted straight up; the foot then turns about it until the heel is up.

    Args:
        toe: toe bases wanted (n, 2, 3).
        R_foot: feet in the world (n, 2, 3, 3).
        shape: of the feet.

    Returns:
        toe (n, 2, 3), R_foot (n, 2, 3, 3).
    """
    toe = np.array(toe)
    toe[..., 1] = np.maximum(toe[..., 1], shape.ball_m)
    R_foot = raised(rotate(R_foot, shape.heel), -toe[..., 1], -R_foot[..., :, 1]) @ R_foot
    return toe, R_foot


def toes_on_floor(toe: Array, R_foot: Array, shape: FootShape) -> Array:
    """Toes in the world: as the foot, bent up where their tip would go under the floor.

    Nothing predicts the toes; at push-off they stay on the floor.
    """
    tip = rotate(R_foot, shape.tip)
    return np.asarray(raised(tip, shape.tip_m - toe[..., 1], R_foot[..., :, 1]) @ R_foot)
