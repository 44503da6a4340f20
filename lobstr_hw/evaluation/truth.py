"""The truth of a clip: what trackers without noise would say, and what the legs really did."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobstr_hw.contact_labels import contact_labels, paper_contact_labels
from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import true_lower_body
from lobstr_hw.motion import Motion
from lobstr_hw.predictors import Frame
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT

__all__ = ["Truth", "stacked_frame"]

Bools = npt.NDArray[np.bool_]

TOES = (Joint.LEFT_TOES, Joint.RIGHT_TOES)
_TRACKED = [ROLE_JOINT[role] for role in FOUR_POINTS]


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A clip on the standard skeleton.

    Attributes:
        name: of the clip.
        rate_hz: frames per second.
        p: (frames, 4, 3) the tracked joints, in the order of FOUR_POINTS.
        R: (frames, 4, 3, 3).
        p_hips: (frames, 3).
        R_ref: (frames, 3, 3) the reference frame.
        joints: (frames, 2, 4, 3, 3) C, U, L, F.
        p_toes: (frames, 2, 3) toe bases in the world, by FK.
        contact: (frames, 2) by height over a local floor, and speed.
        paper_contact: (frames, 2) by the paper's 1 cm.
    """

    name: str
    rate_hz: float
    p: Array
    R: Array
    p_hips: Array
    R_ref: Array
    joints: Array
    p_toes: Array
    contact: Bools
    paper_contact: Bools

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.p)

    @staticmethod
    def of(motion: Motion) -> "Truth":
        """Work out the truth of a motion."""
        p, R = motion.joints()
        R_ref = reference_frames(R[:, Joint.HIPS])
        return Truth(
            name=motion.name,
            rate_hz=motion.rate_hz,
            p=p[:, _TRACKED],
            R=R[:, _TRACKED],
            p_hips=motion.p_hips,
            R_ref=R_ref,
            joints=true_lower_body(motion.R_local, R_ref),
            p_toes=p[:, TOES],
            contact=contact_labels(motion.p_toes, motion.rate_hz),
            paper_contact=paper_contact_labels(motion.p_toes),
        )


def stacked_frame(clips: list[Truth], i: int) -> Frame:
    """Frame i of several clips side by side; a clip that is over holds its last frame."""
    at = [min(i, len(clip) - 1) for clip in clips]
    everywhere = np.ones((len(clips), len(FOUR_POINTS)), dtype=bool)
    return Frame(
        time_s=i / clips[0].rate_hz,
        roles=FOUR_POINTS,
        p=np.stack([clip.p[k] for clip, k in zip(clips, at, strict=True)]),
        R=np.stack([clip.R[k] for clip, k in zip(clips, at, strict=True)]),
        valid_p=everywhere,
        valid_R=everywhere,
    )
