"""VMC protocol over UDP: standalone headsets, VirtualMotionCapture and relays of all kinds.

    lobstr-live --driver vmc                        (senders on this machine, port 39540)
    lobstr-live --driver vmc:bind=0.0.0.0           (senders in the network: anybody's)

Read are ``/VMC/Ext/{Hmd,Con,Tra}/Pos``, their ``/Local`` forms (raw room coordinates, which are
preferred where a sender has both) and ``/VMC/Ext/Set/Calib/*``; every other address is ignored.
The sender's clock, ``/VMC/Ext/T``, counts where it is in the same datagram as the poses.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np

from lobstr_hw.drivers.driver import DeviceInfo, Probe
from lobstr_hw.drivers.osc import OscMessage, read_packet
from lobstr_hw.drivers.reading_thread import Arrival, Command, Reading
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.drivers.udp_port import UdpPort
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import from_quat_xyzw
from lobstr_hw.trackers import TrackerRole

__all__ = ["Space", "VmcDriver", "VmcPose", "device_time_s", "pose_from_unity", "read_pose"]

PORT = 39540
"""Where a VMC "performer" listens for the devices of an assistant."""
MOST_TRACKERS = 64
"""Serials come from the network: a sender that makes up new ones must not fill the memory."""
LONGEST_SERIAL = 64
FARTHEST_M = 1000.0
PRECISE_S = 16384.0
"""After four and a half hours the 32-bit float of ``/VMC/Ext/T`` has steps of 2 ms: too coarse."""

KINDS = {"Hmd": "headset", "Con": "controller", "Tra": "tracker"}
POSES = {
    f"/VMC/Ext/{name}/Pos{end}": (kind, end != "")
    for name, kind in KINDS.items()
    for end in ("", "/Local")
}
COMMANDS = {
    "/VMC/Ext/Set/Calib/Ready": "calibrate_ready",
    "/VMC/Ext/Set/Calib/Exec": "calibrate",
}
PELVIS_WORDS = ("pelvis", "waist", "hip")


class Space(StrEnum):
    """Which of a sender's two coordinates to take."""

    AUTO = "auto"
    POS = "pos"
    LOCAL = "local"


@dataclass(frozen=True, slots=True, eq=False)
class VmcPose:
    """One device of a message, in our world."""

    serial: str
    kind: str
    local: bool
    T_world_tracker: PartialPose


def pose_from_unity(p: Sequence[float], quat_xyzw: Sequence[float]) -> PartialPose:
    """Unity's left-handed frame, +Z forward -> ours, devices facing -Z: z is mirrored.

    Its own inverse: the same two sign changes lead back.
    """
    x, y, z = p
    qx, qy, qz, qw = quat_xyzw
    return PartialPose(from_quat_xyzw(np.array([-qx, -qy, qz, qw])), np.array([x, y, -z]))


def read_pose(message: OscMessage) -> VmcPose | None:
    """A device's pose, or None where the message is none or its numbers cannot be one.

    Arguments: serial, position x y z in metres, quaternion x y z w; more are ignored.
    """
    if message.address not in POSES or len(message.args) < 8:
        return None
    serial, *numbers = message.args[:8]
    if not isinstance(serial, str) or not 0 < len(serial) <= LONGEST_SERIAL:
        return None
    values = [float(n) for n in numbers if isinstance(n, float)]
    if len(values) != 7 or not serial.isprintable() or not _is_pose(values):
        return None
    kind, local = POSES[message.address]
    return VmcPose(serial, kind, local, pose_from_unity(values[:3], values[3:]))


def _is_pose(values: Sequence[float]) -> bool:
    norm = math.hypot(*values[3:])  # NaN fails both comparisons; zeros are "not tracked" in Unity
    return all(abs(v) < FARTHEST_M for v in values[:3]) and 0.5 < norm < 2.0


def device_time_s(messages: Sequence[OscMessage]) -> float | None:
    """The sender's clock in this datagram, where it is there and precise enough."""
    for message in messages:
        if message.address == "/VMC/Ext/T" and message.args:
            time_s = message.args[0]
            if isinstance(time_s, float) and 0.0 <= time_s < PRECISE_S:
                return time_s
    return None


class VmcDriver(StreamDriver):
    """Every device that somebody sends, by the serial that is sent."""

    options: ClassVar[Mapping[str, Callable[[str], object]]] = {
        "bind": str,
        "port": int,
        "space": Space,
        "left": str,
        "right": str,
    }
    """What ``--driver vmc:...`` understands, and how it is read."""

    def __init__(
        self,
        bind: str = "127.0.0.1",
        port: int = PORT,
        space: Space = Space.AUTO,
        left: str = "",
        right: str = "",
    ) -> None:
        """Choose where to listen.

        Args:
            bind: address of this machine; 0.0.0.0 for all, so that others can send.
            port: of UDP.
            space: ``pos`` or ``local`` coordinates; auto: local ones of a device that has them.
            left: serial of the left controller, where its name does not say so.
            right: of the right one.
        """
        super().__init__()
        if not 0 < port < 65536:
            raise ValueError(f"port={port} is not between 1 and 65535")
        self._bind, self._port, self._space = bind, port, space
        self._hands = {left: TrackerRole.LEFT_HAND, right: TrackerRole.RIGHT_HAND}
        self._kinds: dict[str, str] = {}
        self._local: set[str] = set()

    @classmethod
    def probe(cls) -> Probe:
        """Listening needs nothing but a free port."""
        return Probe(available=True)

    def _connect(self) -> "_Sender":
        self._kinds, self._local = {}, set()
        return _Sender(UdpPort(self._bind, self._port), self._arrivals)

    def _arrivals(self, data: bytes) -> Iterator[Arrival]:
        """What one datagram says."""
        messages = read_packet(data)
        device_s = device_time_s(messages)
        poses = [pose for message in messages if (pose := read_pose(message)) is not None]
        self._local.update(pose.serial for pose in poses if pose.local and self._known(pose))
        for pose in poses:
            if self._known(pose) and pose.local == self._wants_local(pose.serial):
                yield Reading(pose.serial, pose.T_world_tracker, device_s=device_s)
        for message in messages:
            if message.address in COMMANDS:
                yield Command(COMMANDS[message.address])

    def _known(self, pose: VmcPose) -> bool:
        if pose.serial not in self._kinds and len(self._kinds) < MOST_TRACKERS:
            self._kinds[pose.serial] = pose.kind
        return self._kinds.get(pose.serial) == pose.kind

    def _wants_local(self, serial: str) -> bool:
        return serial in self._local if self._space is Space.AUTO else self._space is Space.LOCAL

    def _info(self, serial: str) -> DeviceInfo:
        kind = self._kinds.get(serial, "tracker")
        return DeviceInfo(serial, kind, "VMC", self._role_hint(serial, kind))

    def _role_hint(self, serial: str, kind: str) -> TrackerRole | None:
        word = serial.lower()
        if serial in self._hands:
            return self._hands[serial]
        if kind == "headset":
            return TrackerRole.HEAD
        if kind == "controller" and "left" in word:
            return TrackerRole.LEFT_HAND
        if kind == "controller" and "right" in word:
            return TrackerRole.RIGHT_HAND
        is_pelvis = kind == "tracker" and any(name in word for name in PELVIS_WORDS)
        return TrackerRole.PELVIS if is_pelvis else None


class _Sender:
    """Whoever sends to an open port."""

    def __init__(self, port: UdpPort, arrivals: Callable[[bytes], Iterator[Arrival]]) -> None:
        self._port, self._arrivals = port, arrivals

    def read(self) -> Sequence[Arrival]:
        return list(self._arrivals(self._port.read()))

    def close(self) -> None:
        self._port.close()
