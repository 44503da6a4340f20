"""A motion clip on the standard skeleton: what retargeting makes and training reads."""

from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.poses import frozen
from lobstr_hw.rotations import Array, slerp
from lobstr_hw.skeleton import forward_kinematics, mirror_rotations

__all__ = ["Motion", "mirrored", "resampled"]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Frames of one person on the standard skeleton (hips at 1.0 m, floor at y = 0).

    Attributes:
        name: set and clip, ``"snu_tennis/tennis_KangTennisF15"``.
        subject: the person.
        rate_hz: frames per second.
        p_hips: (frames, 3) world.
        R_local: (frames, 22, 3, 3), the hips in the world.
        p_toes: (frames, 2, 3) the source rig's own toe bases, scaled; contacts are told from these.
        metres: what 1.0 m of this skeleton was on the person (so ``1 / metres`` is the scale s).
    """

    name: str
    subject: str
    rate_hz: float
    p_hips: Array
    R_local: Array
    p_toes: Array
    metres: float

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "p_hips", frozen(self.p_hips, (3,)))
        object.__setattr__(self, "R_local", frozen(self.R_local, (22, 3, 3)))
        object.__setattr__(self, "p_toes", frozen(self.p_toes, (2, 3)))

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.p_hips)

    @property
    def duration_s(self) -> float:
        """From the first frame to the last."""
        return (len(self) - 1) / self.rate_hz

    def joints(self) -> tuple[Array, Array]:
        """World positions (frames, 22, 3) and rotations (frames, 22, 3, 3) by FK."""
        return forward_kinematics(self.R_local, self.p_hips)


def resampled(motion: Motion, rate_hz: float) -> Motion:
    """The same motion at another rate: positions linear, rotations by slerp."""
    times = np.arange(int(motion.duration_s * rate_hz + 1e-9) + 1) / rate_hz
    at = times * motion.rate_hz
    i = np.minimum(at.astype(int), len(motion) - 1)
    j = np.minimum(i + 1, len(motion) - 1)
    f = at - i

    def between(values: Array) -> Array:
        w = f.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray((1.0 - w) * values[i] + w * values[j])

    return replace(
        motion,
        rate_hz=rate_hz,
        p_hips=between(motion.p_hips),
        R_local=slerp(motion.R_local[i], motion.R_local[j], f[:, None]),
        p_toes=between(motion.p_toes),
    )


def mirrored(motion: Motion) -> Motion:
    """Left and right exchanged about the plane x = 0; twice is the motion itself."""
    flip = np.array([-1.0, 1.0, 1.0])
    return replace(
        motion,
        name=motion.name + "~mirrored",
        p_hips=motion.p_hips * flip,
        R_local=mirror_rotations(motion.R_local),
        p_toes=motion.p_toes[:, ::-1] * flip,
    )
