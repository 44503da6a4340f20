"""The predictor interface: a step is a function, all state is in its arguments."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.trackers import TrackerRole

__all__ = ["Bools", "Frame", "ModelCard", "Prediction", "Predictor", "State"]

Bools = npt.NDArray[np.bool_]

State = dict[str, npt.NDArray[Any]]
"""Everything a step remembers: flat, arrays with leading n; copied, saved, compared, put back."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Joint poses of n people at one time, lengths scaled to the standard skeleton (hips at 1.0 m).

    Attributes:
        time_s: of the frame.
        roles: the card's accepts, the same all session.
        p: (n, roles, 3) positions of the roles' JOINTS (not trackers) in the world.
        R: (n, roles, 3, 3) rotations of these joints in the world.
        valid_p: (n, roles) which positions were measured; others hold a best guess, never NaN.
        valid_R: (n, roles) which rotations were measured.
    """

    time_s: float
    roles: tuple[TrackerRole, ...]
    p: Array
    R: Array
    valid_p: Bools
    valid_R: Bools

    def index(self, role: TrackerRole) -> int:
        """Where a role stands in the arrays."""
        return self.roles.index(role)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What a predictor says about the body ``delay_frames`` ago.

    Attributes:
        R: (n, joints given, 3, 3), each in its parent, or in the reference frame where the parent
            is not given (``lobstr``: the upper legs).
        contact: (n, 2) probability that the left and the right foot are on the floor.
        C: (n, 2, 3, 3) the two hip joints of the paper; for losses and scores only; or None.
        p_hips: (n, 3) world, where the predictor gives the hips; or None.
    """

    R: Array
    contact: Array
    C: Array | None = None
    p_hips: Array | None = None


@dataclass(frozen=True, slots=True)
class ModelCard:
    """What a model is and needs; it travels with the weights as JSON.

    Attributes:
        name: of the predictor.
        version: of these weights.
        rate_hz: of its time grid.
        delay_frames: how many grid steps ago the output was.
        needs: roles without which it cannot run.
        accepts: roles it looks at, in the order of Frame.
        gives: joints of Prediction.R, in order.
        contacts: whether it predicts contacts.
        feature_version: of lobstr_hw.features.
        skeleton_version: of lobstr_hw.skeleton.
        details: architecture, training data and licences, metrics.
    """

    name: str
    version: str
    rate_hz: float
    delay_frames: int
    needs: tuple[TrackerRole, ...]
    accepts: tuple[TrackerRole, ...]
    gives: tuple[Joint, ...]
    contacts: bool
    feature_version: int
    skeleton_version: int
    details: dict[str, Any] = field(default_factory=dict)


class Predictor(Protocol):
    """Moves the joints that no tracker sees.

    ``step`` is pure: the same state and frame give the same result, and nothing hides in a session
    or an object. Arrays have a leading axis of n people.
    """

    @property
    def card(self) -> ModelCard:
        """What it is and needs."""
        ...

    def start(self, body: Body) -> State:
        """The state before the first frame; per-user terms are computed here, once."""
        ...

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        """Advance by one grid step (1 / rate_hz seconds)."""
        ...

    def shift_world(self, state: State, T: Array) -> State:
        """The play space moved by T (n, 4, 4): the same state seen from there."""
        ...
