"""What the fake person does, second by second: poses between which it moves, and buttons."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.rotations import Array, from_rotation_vector, rotation_x, rotation_y, rotation_z
from lobstr_hw.skeleton import Body, Joint, forward_kinematics
from lobstr_hw.trackers import TrackerRole

__all__ = ["SCRIPTS", "Move", "Press", "Script"]

ARMS_DOWN = np.radians(75.0)
Bools = npt.NDArray[np.bool_]
_LEFT, _RIGHT = TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND


@dataclass(frozen=True, slots=True)
class Press:
    """A button held from one time to another."""

    role: TrackerRole
    button: str
    down_s: float
    up_s: float


@dataclass(frozen=True, slots=True)
class Move:
    """One movement: ``shape`` of the time, 0 at its start and 1 at its end, scales it.

    What the shape is at its end stays for good.
    """

    kind: str
    start_s: float
    end_s: float
    shape: Callable[[Array], Array]


@dataclass(frozen=True, slots=True)
class Script:
    """A whole play.

    Attributes:
        arms: times and how far the arms are down, 0 (out) to 1 (hanging), straight between.
        moves: what else happens.
        presses: of buttons.
        in_hand: from when to when the pelvis tracker is held against the left controller instead of
            sitting on its belt.
    """

    arms: Sequence[tuple[float, float]]
    moves: Sequence[Move] = ()
    presses: Sequence[Press] = field(default_factory=tuple)
    in_hand: tuple[float, float] = (0.0, 0.0)

    def joints(self, times_s: Array, body: Body) -> tuple[Array, Array]:
        """The person (m, 22, 3) and (m, 22, 3, 3); the legs stay straight."""
        at, down = zip(*self.arms, strict=True)
        lowered = ARMS_DOWN * _smooth(np.interp(times_s, at, down))
        size = float(1.0 / body.scale[0])
        R = np.tile(np.eye(3), (len(times_s), 22, 1, 1))
        R[:, Joint.LEFT_UPPER_ARM] = rotation_z(-lowered)
        R[:, Joint.RIGHT_UPPER_ARM] = rotation_z(lowered)
        p_hips = np.tile(body.offsets[0, Joint.HIPS], (len(times_s), 1))
        for move in self.moves:
            x = np.clip((times_s - move.start_s) / (move.end_s - move.start_s), 0.0, 1.0)
            since = x > 0.0
            if since.any():
                _MOVES[move.kind](move.shape(x[since]), R, p_hips, since, size)
        return forward_kinematics(R, p_hips, body.offsets[0])

    def events(
        self, after_s: float, until_s: float, serials: Mapping[TrackerRole, str]
    ) -> list[DeviceEvent]:
        """Buttons in (after_s, until_s], oldest first."""
        events = [
            DeviceEvent(kind, serials[press.role], time_s, press.button)
            for press in self.presses
            for kind, time_s in (
                (EventKind.BUTTON_DOWN, press.down_s),
                (EventKind.BUTTON_UP, press.up_s),
            )
            if after_s < time_s <= until_s
        ]
        return sorted(events, key=lambda event: event.time_s)


def _smooth(x: Array) -> Array:
    return np.asarray(x * x * (3.0 - 2.0 * x))


def _bump(x: Array) -> Array:
    """Out and back once."""
    return np.asarray(np.sin(np.pi * x) ** 2)


def _waves(n: int) -> Callable[[Array], Array]:
    """To and fro n times."""
    return lambda x: np.asarray(np.sin(2.0 * np.pi * n * x) * np.minimum(1.0, 8.0 * x * (1.0 - x)))


def _nod(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    R[at, Joint.NECK] = R[at, Joint.NECK] @ rotation_x(np.radians(15.0) * a)
    R[at, Joint.HEAD] = R[at, Joint.HEAD] @ rotation_x(np.radians(15.0) * a)


def _shake(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    R[at, Joint.HEAD] = R[at, Joint.HEAD] @ rotation_y(np.radians(30.0) * a)


def _twist(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    for hand in (Joint.LEFT_HAND, Joint.RIGHT_HAND):
        R[at, hand] = R[at, hand] @ rotation_x(np.radians(60.0) * a)


def _wave(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    for hand in (Joint.LEFT_HAND, Joint.RIGHT_HAND):
        R[at, hand] = R[at, hand] @ rotation_z(np.radians(35.0) * a)


def _bow(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    """Forward from the hips; seat and hips give way behind."""
    R[at, Joint.HIPS] = R[at, Joint.HIPS] @ rotation_x(np.radians(25.0) * a)
    R[at, Joint.SPINE] = R[at, Joint.SPINE] @ rotation_x(np.radians(20.0) * a)
    p[at, 2] -= 0.08 * size * a


def _walk(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    """Three steps forward, bobbing with every one."""
    p[at, 2] += 1.3 * size * a
    p[at, 1] -= 0.015 * size * (1.0 - np.cos(6.0 * np.pi * a)) / 2.0


def _turn(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    """Once round, on the spot."""
    R[at, Joint.HIPS] = rotation_y(2.0 * np.pi * a) @ R[at, Joint.HIPS]


def _swirl(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    """A hand turned about all axes: steering wheel, key and nod at once."""
    strength = np.minimum(1.0, 12.0 * a * (1.0 - a))
    about = np.stack([np.sin(2.0 * np.pi * n * a + n) for n in (5.0, 7.0, 4.0)], axis=-1)
    turn = from_rotation_vector(np.radians(45.0) * strength[:, None] * about)
    R[at, Joint.LEFT_LOWER_ARM] = R[at, Joint.LEFT_LOWER_ARM] @ turn


def _reach_down(a: Array, R: Array, p: Array, at: Bools, size: float) -> None:
    """Crouch and lay the right hand down."""
    p[at, 1] -= 0.45 * size * a
    R[at, Joint.SPINE] = R[at, Joint.SPINE] @ rotation_x(np.radians(45.0) * a)


_MOVES: Mapping[str, Callable[[Array, Array, Array, Bools, float], None]] = {
    "nod": _nod,
    "shake": _shake,
    "twist": _twist,
    "wave": _wave,
    "bow": _bow,
    "walk": _walk,
    "turn": _turn,
    "reach_down": _reach_down,
    "swirl": _swirl,
}


def _movement(start_s: float) -> tuple[Move, ...]:
    """What a person does when asked to move: ten seconds."""
    parts = (
        ("nod", 1.4, _waves(2)),
        ("shake", 1.0, _waves(1)),
        ("twist", 1.4, _waves(2)),
        ("wave", 1.0, _waves(1)),
        ("bow", 1.4, _bump),
        ("walk", 2.0, _smooth),
        ("turn", 2.2, _smooth),
    )
    moves = []
    for kind, seconds, shape in parts:
        moves.append(Move(kind, start_s, start_s + seconds, shape))
        start_s += seconds
    return tuple(moves)


def _calibrating(start_s: float = 0.0) -> Script:
    """Somebody who does as the wizard says, from ``start_s`` on."""
    arms = ((2.0, 1.0), (2.8, 0.0), (6.2, 0.0), (7.0, 1.0))
    # agrees to the roles; then goes on as soon as each part of the movement is done
    pressed_s = (0.8, 6.6, 9.6, 12.0, 13.4, 15.4, 17.7)
    return Script(
        arms=((0.0, 1.0), *((start_s + time_s, down) for time_s, down in arms)),
        moves=_movement(start_s + 7.1),
        presses=tuple(
            Press(_RIGHT, "trigger", start_s + time_s, start_s + time_s + 0.1)
            for time_s in pressed_s
        ),
    )


def _joining(start_s: float) -> Script:
    """The same, after the pelvis tracker was held against the left controller for a while."""
    script, held = _calibrating(start_s), (0.0, start_s - 1.0)
    swirl = Move("swirl", *held, lambda x: x)
    return replace(script, moves=(swirl, *script.moves), in_hand=held)


def _pointing(start_s: float) -> Script:
    """The same, after stretching out both arms once, so that nameless trackers are told apart."""
    script = _calibrating(start_s)
    once = ((0.0, 1.0), (1.0, 1.0), (1.8, 0.0), (3.0, 0.0), (3.8, 1.0))
    return replace(script, arms=(*once, *script.arms[1:]))


SCRIPTS: Mapping[str, Script] = {
    "calibrate": _calibrating(),
    "join": _joining(16.0),
    "point": _pointing(4.0),
    "gestures": Script(
        arms=((0.0, 0.0), (4.0, 0.0), (5.0, 1.0)),
        presses=(
            Press(_LEFT, "trigger", 6.0, 8.0),
            Press(_RIGHT, "trigger", 6.1, 8.0),
            Press(_LEFT, "grip", 9.0, 11.0),
            Press(_RIGHT, "grip", 9.0, 11.0),
            Press(_LEFT, "grip", 12.0, 14.0),
            Press(_RIGHT, "grip", 12.1, 14.0),
            Press(_RIGHT, "menu", 15.0, 17.0),
            Press(_LEFT, "menu", 18.0, 20.0),
            Press(_RIGHT, "grip", 21.0, 21.8),
            Press(_RIGHT, "menu", 21.3, 21.5),
        ),
    ),
}
"""What ``--driver fake:script=NAME`` plays."""
