"""One open device: it is asked what it is, set going, and followed, in a thread of its own.

wait for a device ─► ask what it is ─► follow it ─► unplugged: the end
▲  (a dongle: nothing may be switched on behind it)  │
└────────── switched off, or silent ─────────────────┘
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from threading import Event, Thread

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.device_commands import (
    ask_ranges,
    ask_version,
    download_config,
    set_light_mode,
    start_reports,
)
from lobstr_hw.drivers.lighthouse.device_config import parse_config
from lobstr_hw.drivers.lighthouse.device_follower import About, DeviceFollower, News
from lobstr_hw.drivers.lighthouse.device_reader import OLD_RADIO, DeviceReader
from lobstr_hw.drivers.lighthouse.light import Stations
from lobstr_hw.drivers.lighthouse.light_mode import LightMode
from lobstr_hw.drivers.lighthouse.sight import Sight
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.transport import NoAnswer, OpenDevice
from lobstr_hw.drivers.lighthouse.usb_ids import DeviceKind
from lobstr_hw.drivers.reading_thread import LinkLost, Lost, Notice
from lobstr_hw.errors import FileFormatError

__all__ = ["DeviceSession"]

READ_S = 0.05
IDLE_S = 0.002
"""A pause after a read that brought nothing, for reads that do not wait themselves."""
RETRY_S, BROKEN_S = 1.0, 5.0
QUICK_TRIES, QUICK_S = 5, 0.02
"""What is being switched on behind a dongle answers within this time; then it is asked seldom."""
SILENT_READS = 60
"""Reads in vain (3 s) after which somebody else may answer behind a dongle."""
PLUG_AGAIN = "It is left out until it answers: unplug it and plug it in again."
SWITCH_ON = "Switch on its tracker or controller."
ONLY_GEN1 = frozenset({DeviceKind.HEADSET, DeviceKind.WAND, DeviceKind.TRACKER})


class DeviceSession:
    """Follows one USB device until it is unplugged or closed.

    Attributes:
        about: what it is, or what is behind it; None: nobody knows (any more).
        tracked: the device while it is followed.
        sight: what it sees.
        settled: set once it is known what it is, or that it does not say.
        ended: the thread is done and the device let go of.
        surveyed: what it sees is handed on.
    """

    def __init__(
        self,
        device: OpenDevice,
        stations: Stations,
        gen2: bool,
        put: Callable[[News], None],
        told: set[str],
        numbers: Iterator[int],
    ) -> None:
        """Start.

        Args:
            device: open; is closed at the end.
            stations: to be tracked by.
            gen2: the light mode to begin with.
            put: takes what happens, from another thread.
            told: words that were said already; is added to.
            numbers: for naming its clock: one each time that it is switched on, given to no other.
        """
        self.device = device
        self.about: About | None = None
        self.tracked: TrackedDevice | None = None
        self.sight: Sight | None = None
        self.settled, self.ended = Event(), Event()
        self.surveyed = False
        self._stations = self._used = (stations, 0)  # and the number of their world
        self._gen2, self._put = gen2, put
        self._stop = Event()
        self._refused = 0
        self._told, self._numbers = told, numbers
        name = f"lobstr-{device.info.key}"
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def use_stations(self, stations: Stations, same_world: bool) -> None:
        """Be tracked by others from now on; from one thread only."""
        _, world = self._stations
        self._stations = (stations, world if same_world else world + 1)

    def stop(self) -> None:
        """Begin to end; waits for nothing."""
        self._stop.set()

    def close(self, wait_s: float = 5.0) -> None:
        """End; the device is let go of, as a rule within ``wait_s``."""
        self.stop()
        self._thread.join(timeout=wait_s)

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self.about = self._ask()
                if self.about is not None:
                    self.settled.set()
                    self._follow(self.about)
        except (LinkLost, OSError):
            pass
        except Exception as error:  # a fault here must not hide the other devices
            self._tell(f"{self.device.info.name}: following it failed ({error!r}); report this.")
        finally:
            self._lose()
            self.device.close()
            self.settled.set()
            self.ended.set()

    def _tell(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            self._put(Notice(text))

    def _lose(self) -> None:
        if self.about is not None:
            self._put(Lost(self.about.model.serial))
        self.about = self.tracked = self.sight = None

    def _ask(self) -> About | None:
        """What it is; None: it does not say, and is to be asked again.

        In this order all devices are known to start: configuration, light, version, ranges.
        """
        try:
            model = parse_config(download_config(self.device))
            mode = self._mode(model)
            start_reports(self.device, mode.gen2)
            version, ranges = ask_version(self.device), ask_ranges(self.device)
        except FileFormatError as error:
            self._tell(f"{self.device.info.name}: {error}. {PLUG_AGAIN}")
            self.settled.set()
            self._stop.wait(BROKEN_S)
        except NoAnswer as error:
            self._no_answer(error)
            self._stop.wait(QUICK_S if self._refused <= QUICK_TRIES else RETRY_S)
        else:
            self._refused = 0
            return About(model, version.firmware if version else "", ranges, mode)
        return None

    def _no_answer(self, error: NoAnswer) -> None:
        self._refused += 1
        if self._refused > QUICK_TRIES:
            if self.device.info.kind is DeviceKind.DONGLE:
                self._tell(
                    f"{self.device.info.name}: nothing is switched on behind it. {SWITCH_ON}"
                )
            else:
                self._tell(f"{error}. {PLUG_AGAIN}")
            self.settled.set()

    def _mode(self, model: DeviceModel) -> LightMode:
        kind = self.device.info.kind
        by_radio = kind is DeviceKind.DONGLE
        only_gen1 = kind in ONLY_GEN1 or (by_radio and model.product_id in OLD_RADIO)
        return LightMode(self._gen2 and not only_gen1, not only_gen1, tells=not by_radio)

    def _follow(self, about: About) -> None:
        """Until it is switched off or falls silent."""
        by_radio = self.device.info.kind is DeviceKind.DONGLE
        old_radio = by_radio and about.model.product_id in OLD_RADIO
        reader = DeviceReader(old_radio, about.mode.gen2 and by_radio)
        self._used = self._stations
        tracked = TrackedDevice(about.model, self._used[0], about.ranges, reader)
        self.sight, self.tracked = Sight(len(about.model.points)), tracked
        clock = f"{self.device.info.key}/{next(self._numbers)}"
        follower = DeviceFollower(tracked, about, self.sight, clock)
        silent = 0
        while not (self._stop.is_set() or reader.gone or (by_radio and silent > SILENT_READS)):
            report = self.device.read(READ_S)
            self._obey(tracked)
            if report is None:
                silent += 1
                self._stop.wait(IDLE_S)
                continue
            silent = 0
            for news in follower.feed(report, self.surveyed):
                self._put(news)
            if follower.wants_other_light():
                self._switch_light(about.mode.gen2, reader)
        self._lose()

    def _obey(self, tracked: TrackedDevice) -> None:
        """Use the newest stations; others may be named meanwhile, so nothing is written back."""
        before, self._used = self._used, self._stations
        if self._used is not before:
            stations, world = self._used
            tracked.use_stations(stations, same_world=world == before[1])

    def _switch_light(self, gen2: bool, reader: DeviceReader) -> None:
        with suppress(NoAnswer):
            set_light_mode(self.device, gen2)
        reader.sees_gen2 = False
        if self.device.info.kind is DeviceKind.DONGLE:
            reader.switch_light(gen2)
