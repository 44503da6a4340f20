"""Reports of one device -> its raw events: samples sorted, repeats dropped, times unwrapped."""

from lobstr_hw.drivers.lighthouse.beginning import Beginning, LightReport
from lobstr_hw.drivers.lighthouse.compact_light import parse_compact_light
from lobstr_hw.drivers.lighthouse.gen2_words import SyncWord, parse_words
from lobstr_hw.drivers.lighthouse.radio import Inputs, RadioMessage, parse_message
from lobstr_hw.drivers.lighthouse.raw_events import EventLists, RawEvents
from lobstr_hw.drivers.lighthouse.reports import (
    BeamReport,
    CableReport,
    GoneReport,
    ImuReport,
    ImuSlot,
    PulseReport,
    RadioReport,
    SweepReport,
    parse_report,
)
from lobstr_hw.drivers.lighthouse.ticks import Ticks

__all__ = ["OLD_RADIO", "DeviceReader"]

OLD_RADIO = frozenset({0x2012, 0x2022})
"""Product ids of wand and Tracker 1.0, which keep to the old radio protocol and to Gen1."""
IN_FLIGHT = 20
"""Radio messages after a change of the light mode whose light may still be of the old one."""
HALF_ROUND = 128
SHORTEST_LIGHT = 4
"""Bytes: a time and at least something before it."""


class DeviceReader:
    """Takes the reports of one device in their order; ``take`` hands out what they held.

    Attributes:
        battery: 0 to 1, or None: not told yet.
        charging: as last told.
        inputs: the latest buttons and the like by radio, or None.
        buttons: bits by radio, as last told (``Inputs.buttons``), or None.
        cable_buttons: bits by cable (``CableReport.buttons``), or None.
        sees_gen2: it lies in the light of Gen2 stations but is set up for Gen1.
        gone: the tracker behind the dongle was switched off and has said nothing since.
        unreadable: radio messages and light data that made no sense.
    """

    def __init__(self, old_radio: bool, gen2_light: bool) -> None:
        """Nothing was heard.

        Args:
            old_radio: which radio protocol, by OLD_RADIO; nothing by cable.
            gen2_light: the light mode that the device was set to, by radio; a cable's reports tell.
        """
        self._old_radio = old_radio
        self._gen2_light = gen2_light and not old_radio
        self._in_flight = 0
        self._ticks = Ticks()
        self._sequence: int | None = None
        self._beginning = Beginning()
        self.battery: float | None = None
        self.charging = False
        self.inputs: Inputs | None = None
        self.buttons: int | None = None
        self.cable_buttons: int | None = None
        self.sees_gen2 = self.gone = False
        self.unreadable = 0
        self._lists = EventLists()

    @property
    def newest_tick(self) -> int | None:
        """The device's time: that of the newest IMU sample, or None before the first."""
        return self._ticks.newest

    def feed(self, data: bytes) -> None:
        """One input report; what is no report of such a device is left alone."""
        match parse_report(data):
            case ImuReport(slots):
                self._add_imu(slots)
            case PulseReport() | SweepReport() as light:
                self._add_cable_light(light)
            case RadioReport(messages):
                self.gone = False
                for message in messages:
                    self._add_message(parse_message(message, self._old_radio))
            case BeamReport():
                self.sees_gen2 = True
            case GoneReport():
                self.gone = True
            case CableReport() as said:
                self._add_cable(said)

    def use_old_radio(self) -> None:
        """It turned out to be a device of the old radio protocol."""
        self._old_radio, self._gen2_light = True, False

    def switch_light(self, gen2: bool) -> None:
        """The device was told to change its light mode; by radio, some light is lost with it."""
        if gen2 != self._gen2_light and not self._old_radio:
            self._gen2_light, self._in_flight = gen2, IN_FLIGHT

    def finish(self) -> None:
        """No more will come: what still waits for more of the device's samples goes without."""
        self._beginning.over = True
        self._release()

    def take(self) -> RawEvents:
        """What was heard since the last call."""
        lists, self._lists = self._lists, EventLists()
        return lists.events()

    def _add_imu(self, slots: tuple[ImuSlot, ...]) -> None:
        """The samples that are newer than the last one: sequence numbers go round at 256."""
        newest = self._sequence
        last = slots[0][0] - HALF_ROUND if newest is None else newest
        by_age = {(slot[0] - last) & 0xFF: slot for slot in slots}
        for age, slot in sorted(by_age.items()):
            if newest is None or 0 < age < HALF_ROUND:
                self._sequence = slot[0]
                ticks = self._ticks.imu(slot[1])
                self._lists.imu.append((ticks, *slot[2]))
                self._beginning.sample(ticks)
        if self._beginning.over:
            self._release()

    def _release(self) -> None:
        for light in self._beginning.release():
            self._add_cable_light(light)

    def _add_cable_light(self, light: LightReport) -> None:
        if not self._beginning.over:
            self._beginning.hold(light)
        elif isinstance(light, PulseReport):
            self._add_pulses(light.pulses)
        else:
            self._add_words(light.words)

    def _add_pulses(self, pulses: tuple[tuple[int, int, int], ...]) -> None:
        for port, low, length in pulses:
            start = self._light_time(low, 32)
            if start is not None:
                self._lists.pulses.append((port, start, length))

    def _add_words(self, data: bytes) -> None:
        for word in parse_words(data):
            ticks = self._light_time(word.time, 24)
            if ticks is None:
                continue
            if isinstance(word, SyncWord):
                self._lists.syncs.append((word.channel, ticks, word.data_bit, word.g_bit))
            else:
                self._lists.add_sweep((word.channel, word.port, ticks, word.half_tick))

    def _light_time(self, low: int, bits: int) -> int | None:
        """None: nobody knows, or it was left over from before."""
        ticks = self._ticks.light(low, bits)
        return ticks if ticks is not None and self._beginning.is_true(ticks, bits) else None

    def _add_cable(self, said: CableReport) -> None:
        if said.buttons is not None:
            self.cable_buttons = said.buttons
        if said.battery is not None:
            self.battery, self.charging = said.battery, said.charging

    def _add_message(self, message: RadioMessage | None) -> None:
        if message is None:
            self.unreadable += 1
            return
        if message.imu is not None:
            self._lists.imu.append((self._ticks.imu(message.ticks), *message.imu))
        if message.battery is not None:
            self.battery, self.charging = message.battery, message.charging
        if message.inputs is not None:
            self.inputs = message.inputs
            if message.inputs.buttons is not None:
                self.buttons = message.inputs.buttons
        if self._in_flight:
            self._in_flight -= 1
        elif len(message.light) >= SHORTEST_LIGHT:
            self._add_radio_light(message.light)

    def _add_radio_light(self, light: bytes) -> None:
        if self._gen2_light:
            self._add_words(light)
            return
        last_edge = self._ticks.light(int.from_bytes(light[-3:], "little"), 24)
        if last_edge is not None:
            pulses = parse_compact_light(light, last_edge)
            self._lists.pulses += pulses
            self.unreadable += not pulses
