"""A fake person with four trackers: for tests, and for a look around without any device."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, Probe, TrackerDriver
from lobstr_hw.drivers.fake_script import SCRIPTS
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    rotation_x,
    rotation_y,
    rotation_z,
    slerp,
)
from lobstr_hw.skeleton import EYES, GRIP, Body, Joint, forward_kinematics
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT, TrackerRole, TrackerSample

__all__ = ["OTHER_SPACE", "FakeDriver"]

SERIALS = {role: f"FAKE-{role.upper().replace('_', '-')}" for role in FOUR_POINTS}
KINDS = dict(zip(FOUR_POINTS, ("headset", "controller", "controller", "tracker"), strict=True))
MOUNTS = {
    TrackerRole.HEAD: EYES,
    TrackerRole.LEFT_HAND: GRIP,
    TrackerRole.RIGHT_HAND: GRIP * [-1.0, 1.0, 1.0],
    TrackerRole.PELVIS: np.array([0.0, 0.03, 0.11]),
}
"""Where each device sits in its joint, metres on the standard skeleton."""

IN_HAND = Pose(from_rotation_vector(np.array([0.4, -1.1, 2.0])), np.array([0.03, -0.05, 0.08]))
"""The pelvis tracker in the left controller's frame, where a script holds them together."""
STRAP_S = 0.8
"""It takes so long to get from there to the belt."""
OTHER_SPACE = Pose(
    from_rotation_vector(np.array([0.1, 1.9, -0.2])), np.array([1.5, 0.4, -2.0])
).inverse()
"""From the world to the tracking space of a driver with ``apart=1``."""

T_POSE_S = 4.0
"""Long enough for the calibration's 3 s."""
LOWER_S = 1.5
ARMS_DOWN = np.radians(75.0)
SWAY = np.radians(3.0)
SWAY_HZ = 0.3
JITTER_M = 1e-4
"""What Lighthouse trackers show on a table."""


class FakeDriver(TrackerDriver):
    """Someone who stands in a T-pose for 4 s, lowers the arms, then sways for ever.

    The same seed gives the same samples, however it is polled. With a script the person does
    something else instead, and presses buttons.
    """

    options: ClassVar = {
        "seed": int,
        "rate_hz": float,
        "height_cm": float,
        "script": str,
        "named": int,
        "battery": float,
        "has": str,
        "apart": int,
    }
    """What ``--driver fake:...`` understands, and how it is read."""

    def __init__(
        self,
        seed: int = 0,
        rate_hz: float = 90.0,
        height_cm: float = 170.0,
        script: str = "",
        named: int = 1,
        battery: float = 1.0,
        has: str = "",
        apart: int = 0,
    ) -> None:
        """Choose a person.

        Args:
            seed: of the trackers' jitter.
            rate_hz: samples per second and tracker.
            height_cm: stature.
            script: name of a script (drivers/fake_script.py); empty for the plain person.
            named: 0 keeps to itself what each device is, as trackers without roles do.
            battery: of every device, 0 to 1.
            has: roles of the devices that there are, joined by +; all four if empty.
            apart: 1 for poses in a tracking space of its own (``OTHER_SPACE``).
        """
        if script and script not in SCRIPTS:
            raise ValueError(f"no script is called {script!r}; known: {', '.join(SCRIPTS)}")
        if rate_hz <= 0.0 or height_cm <= 0.0:
            raise ValueError(f"rate_hz and height_cm must be positive: {rate_hz}, {height_cm}")
        self._seed, self._rate_hz = seed, rate_hz
        self._body = Body.standard(1, height_cm / 170.6)
        self._script = SCRIPTS.get(script)
        self._named, self._battery = named != 0, battery
        self._roles = _roles(has)
        self._space = OTHER_SPACE if apart else Pose.identity()
        self._next = 0
        self._random = np.random.default_rng(seed)
        self._is_open = False
        self._told_s, self._now_s = -1.0, -1.0

    @classmethod
    def probe(cls) -> Probe:
        """Always there."""
        return Probe(available=True)

    def open(self) -> None:
        """Begin at time 0."""
        self._next, self._random = 0, np.random.default_rng(self._seed)
        self._told_s, self._now_s = -1.0, -1.0
        self._is_open = True

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """The samples at whole multiples of the period, up to now_s."""
        if not self._is_open:
            return ()
        self._now_s = max(self._now_s, now_s)
        stop = int(np.floor(now_s * self._rate_hz + 1e-9)) + 1
        times = np.arange(self._next, stop) / self._rate_hz
        times = times[times <= now_s]
        self._next += len(times)
        if not len(times):
            return ()
        joints = _joints if self._script is None else self._script.joints
        p, R = _trackers(*joints(times, self._body), self._body)
        if self._script is not None:
            _hold(p, R, times, self._script.in_hand)
        p, R = self._space.apply(p), self._space.R @ R
        p = p + self._random.normal(scale=JITTER_M, size=p.shape)
        return [
            TrackerSample(SERIALS[role], PartialPose(R[i, k], p[i, k]), float(time_s), tracked=True)
            for i, time_s in enumerate(times)
            for k, role in enumerate(FOUR_POINTS)
            if role in self._roles
        ]

    def devices(self) -> Sequence[DeviceInfo]:
        """Headset, two controllers, one tracker."""
        if not self._is_open:
            return ()
        if not self._named:
            return [
                DeviceInfo(SERIALS[role], "tracker", "fake", battery=self._battery)
                for role in self._roles
            ]
        return [
            DeviceInfo(SERIALS[role], KINDS[role], "fake", role, battery=self._battery)
            for role in self._roles
        ]

    def events(self) -> Sequence[DeviceEvent]:
        """Buttons that the script presses; otherwise nobody presses anything."""
        if self._script is None or not self._is_open:
            return ()
        events = self._script.events(self._told_s, self._now_s, SERIALS)
        self._told_s = self._now_s
        own = {SERIALS[role] for role in self._roles}
        return [event for event in events if event.serial in own]

    def close(self) -> None:
        """Stop giving samples; twice is harmless."""
        self._is_open = False


def _roles(text: str) -> tuple[TrackerRole, ...]:
    """The devices that there are, in the order of FOUR_POINTS."""
    names = text.split("+") if text else list(FOUR_POINTS)
    unknown = [name for name in names if name not in FOUR_POINTS]
    if unknown:
        raise ValueError(f"has={text}: {unknown[0]!r} is not one of {', '.join(FOUR_POINTS)}")
    return tuple(role for role in FOUR_POINTS if role in names)


def _hold(p: Array, R: Array, times_s: Array, in_hand: tuple[float, float]) -> None:
    """Put the pelvis tracker against the left controller between two times, then on its belt."""
    if in_hand[1] <= in_hand[0]:
        return
    left, pelvis = (FOUR_POINTS.index(r) for r in (TrackerRole.LEFT_HAND, TrackerRole.PELVIS))
    held = 1.0 - _smooth((times_s - in_hand[1]) / STRAP_S)
    p_held, R_held = p[:, left] + R[:, left] @ IN_HAND.p, R[:, left] @ IN_HAND.R
    p[:, pelvis] += held[:, None] * (p_held - p[:, pelvis])
    R[:, pelvis] = slerp(R[:, pelvis], R_held, held)


def _trackers(p: Array, R: Array, body: Body) -> tuple[Array, Array]:
    """Device poses (m, 4, 3) and (m, 4, 3, 3); devices face -Z, so each is turned about Y."""
    joints = [ROLE_JOINT[role] for role in FOUR_POINTS]
    mounts = np.stack([MOUNTS[role] for role in FOUR_POINTS]) / body.scale[0]
    R = R[:, joints]
    return p[:, joints] + (R @ mounts[..., None])[..., 0], R @ rotation_y(np.pi)


def _joints(times_s: Array, body: Body) -> tuple[Array, Array]:
    """The person (m, 22, 3) and (m, 22, 3, 3); the legs, which no tracker sees, stay straight."""
    down = ARMS_DOWN * _smooth((times_s - T_POSE_S) / LOWER_S)
    calm = _smooth((times_s - T_POSE_S - LOWER_S) / LOWER_S)
    sway = calm * SWAY * np.sin(2.0 * np.pi * SWAY_HZ * times_s)
    R = np.tile(np.eye(3), (len(times_s), 22, 1, 1))
    R[:, Joint.LEFT_UPPER_ARM] = rotation_z(-down)
    R[:, Joint.RIGHT_UPPER_ARM] = rotation_z(down)
    R[:, Joint.SPINE] = rotation_z(sway) @ rotation_x(0.5 * sway)
    R[:, Joint.NECK] = rotation_y(2.0 * sway)
    p_hips = np.tile(body.offsets[0, Joint.HIPS], (len(times_s), 1))
    p_hips[:, 0] -= 0.5 * sway / body.scale[0]
    return forward_kinematics(R, p_hips, body.offsets[0])


def _smooth(x: Array) -> Array:
    """0 before 0, 1 after 1, smooth between."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
