"""Vive Ultimate Trackers by their wireless dongle. **Experimental**: never run on a device.

    lobstr-live --driver ultimate
    lobstr-live --driver ultimate:order=zyx     (where turns come out about the wrong axis)

A tracker sees the room with its own cameras; its poses are in its own map, taken to be
right-handed, metres, +Y up. The map is made once with HTC's program. Further trackers share the map
of the first one only when HTC's program has set that up. The dongle has no clock: samples have the
time of their arrival.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import ClassVar

import numpy as np

from lobstr_hw.drivers.driver import DeviceInfo, Probe
from lobstr_hw.drivers.options import yes_no
from lobstr_hw.drivers.reading_thread import Arrival, Lost, Reading
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.drivers.ultimate_dongle import Dongle
from lobstr_hw.drivers.ultimate_reports import (
    LINKS,
    SYSTEM_BUTTON,
    DongleCommand,
    LinkStatus,
    MapState,
    PairEvent,
    PoseReport,
    PoseState,
    QuatOrder,
    TextReport,
    map_state,
    parse_report,
    to_tracker,
)
from lobstr_hw.drivers.vendor import probe_library
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import from_quat_xyzw
from lobstr_hw.trackers import TrackingState

__all__ = ["UltimateDriver"]

ALLOW_PAIRING = bytes([0, 1, 1, 1, 1, 0, 0])
SERIAL_NUMBER = bytes([0x08])
ASK_MAP_STATE = "P63:5"
ASK_EVERY = 500
"""Reports of a tracker between two questions about its map: some seconds."""
HAS_MAP = frozenset({MapState.REBUILT, MapState.SAVED, MapState.REUSED})


class UltimateDriver(StreamDriver):
    """Each link of the dongle is a tracker with the serial ULTIMATE-DONGLE-LINK."""

    options: ClassVar[Mapping[str, Callable[[str], object]]] = {
        "order": QuatOrder,
        "pair": yes_no,
        "start": yes_no,
    }
    """What ``--driver ultimate:...`` understands, and how it is read."""

    def __init__(
        self, order: QuatOrder = QuatOrder.XYZ, pair: bool = False, start: bool = True
    ) -> None:
        """Choose how to listen.

        Args:
            order: of the rotation's last three numbers; sources disagree.
            pair: let new trackers pair with the dongle.
            start: tell trackers to begin tracking, and ask for their maps; else only listen.
        """
        super().__init__()
        self._order, self._pair, self._start = order, pair, start
        self._dongle: _Trackers | None = None

    @classmethod
    def probe(cls) -> Probe:
        """Whether hidapi is here."""
        return probe_library("hid", "hidapi", "hid")

    def _connect(self) -> "_Trackers":
        dongle = Dongle()
        try:
            if self._pair:
                dongle.send(DongleCommand.RADIO, ALLOW_PAIRING)
            self._dongle = _Trackers(dongle, self._order, self._start)
        except OSError as error:
            dongle.close()
            raise TrackerNotFound(
                f"the dongle does not answer ({error}): plug it in again"
            ) from error
        return self._dongle

    def _info(self, serial: str) -> DeviceInfo:
        dongle = self._dongle
        model, firmware = "VIVE Ultimate Tracker", dongle.firmware if dongle else ""
        found = dongle.map_of(serial) if dongle else None
        told = "" if found is None else f", map {found.name.lower().replace('_', ' ')}"
        return DeviceInfo(serial, "tracker", model + told, firmware=firmware)


class _Trackers:
    """The trackers of one dongle: reports in, readings out."""

    def __init__(self, dongle: Dongle, order: QuatOrder, start: bool) -> None:
        self._dongle, self._order, self._start = dongle, order, start
        name = dongle.ask(DongleCommand.IDENTITY, SERIAL_NUMBER)
        self.firmware = dongle.ask(DongleCommand.ROM_VERSION, b"\0")
        prefix = f"ULTIMATE-{name}" if name.isalnum() else "ULTIMATE"
        self.serials = [f"{prefix}-{index}" for index in range(LINKS)]
        self._buttons, self._heard = [0] * LINKS, [0] * LINKS
        self._started: list[int] = []
        self._maps: list[MapState | None] = [None] * LINKS

    def map_of(self, serial: str) -> MapState | None:
        return self._maps[self.serials.index(serial)] if serial in self.serials else None

    def read(self) -> Sequence[Arrival]:
        return list(self._arrivals(self._dongle.read()))

    def close(self) -> None:
        self._dongle.close()

    def _arrivals(self, data: bytes) -> Iterator[Arrival]:
        match parse_report(data):
            case PoseReport() as report:
                yield self._pose(report)
            case TextReport(index, text):
                found = map_state(text)
                self._maps[index] = self._maps[index] if found is None else found
                if text.startswith(("APF", "APR")):  # it says that it switches off, or restarts
                    yield self._gone(index)
            case PairEvent(index, paired):
                if paired:
                    self._begin(index)
                else:
                    yield self._gone(index)
            case LinkStatus(paired):
                yield from (self._gone(i) for i in range(LINKS) if self._heard[i] and not paired[i])

    def _gone(self, index: int) -> Lost:
        self._heard[index], self._buttons[index], self._maps[index] = 0, 0, None
        if index in self._started:
            self._started.remove(index)
        return Lost(self.serials[index])

    def _begin(self, index: int) -> None:
        """Set a tracker going; the first one is the host of the map, the others follow it."""
        if not self._start or index in self._started:
            return
        mode = "ATM11" if self._started else "ATM20"
        self._started.append(index)
        for text in ("ATM-1", mode):
            self._dongle.send(DongleCommand.TO_TRACKER, to_tracker(index, text))

    def _pose(self, report: PoseReport) -> Reading:
        index = report.index
        ask = self._start and self._heard[index] % ASK_EVERY == 0
        if ask and self._maps[index] not in HAS_MAP:
            self._dongle.send(DongleCommand.TO_TRACKER, to_tracker(index, ASK_MAP_STATE))
        self._heard[index] += 1
        buttons = frozenset({"system"} if self._press(report) & SYSTEM_BUTTON else ())
        if report.quat is None or report.p is None:
            self._begin(index)
            return Reading(self.serials[index], None, buttons=buttons)
        if index not in self._started:
            self._started.append(index)
        state = self._state(report.state, self._maps[index])
        w, *rest = report.quat.tolist()
        xyz = rest if self._order is QuatOrder.XYZ else rest[::-1]
        known = report.p if state is TrackingState.OK else None
        pose = PartialPose(from_quat_xyzw(np.array([*xyz, w])), known)
        return Reading(self.serials[index], pose, state, buttons=buttons)

    def _press(self, report: PoseReport) -> int:
        """All buttons: a report has half of them."""
        held = self._buttons[report.index]
        low, high = held & 0x7F, held & 0x7F00
        half = report.buttons & 0x7F
        held = (half << 8 | low) if report.buttons & 0x80 else (high | half)
        self._buttons[report.index] = held
        return held

    @staticmethod
    def _state(state: int, room: MapState | None) -> TrackingState:
        if state == PoseState.FULL:
            return TrackingState.OK
        if state in (PoseState.ROTATION_ONLY, PoseState.FROZEN_POSITION):
            return TrackingState.INERTIAL if room in HAS_MAP else TrackingState.CALIBRATING
        return TrackingState.CALIBRATING
