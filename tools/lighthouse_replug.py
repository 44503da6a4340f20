"""A tracker by cable, unplugged and plugged in again and again: how soon the driver tracks it.

    python tools/lighthouse_replug.py [--times 100] [--seed 0] [--pace 1] [--write docs/results.md]

The tracker and its room are made up (tests/support); umockdev presents it to the real hidapi and
pyusb, and its reports come as time passes: at --pace 0.2 five times slower than a real one's, for a
machine that is busy with other things. Needs
apt-get install umockdev gir1.2-umockdev-1.0 python3-gi libusb-1.0-0.
"""

import argparse
import datetime
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from results_page import write_section

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.lighthouse_bed import RemoteBed, use_system_libusb
from support.lighthouse_devices import named, scripted_device
from support.lighthouse_room import carried, room
from support.lighthouse_wire import reports_of
from support.scripted_usb import ScriptedDevice, load_script, save_script
from support.umockdev_beds import SUPPORT, SYSTEM_PYTHON

from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.station_file import save_stations
from lobstr_hw.drivers.lighthouse.transports import TRANSPORTS
from lobstr_hw.trackers import TrackerSample, TrackingState

HEADING = "## Lighthouse devices unplugged and plugged in again"
INSIDE = "inside"
SCRIPT, STATIONS, RUN = "script.json", "stations.json", "run.json"
CRASHED = "the program crashed"
SERIAL = "LHR-00000001"
STEP_S = 0.005
LENGTH_S = 8.0
PATIENCE_S = 60.0
GOAL_S = 2.0


@dataclass(frozen=True, slots=True)
class Plugging:
    """One plugging in.

    Attributes:
        found_s: from then until the driver has found it, asked it, and told it to begin.
        device_s: from its first report to the first tracked sample, in its own time.
    """

    found_s: float
    device_s: float

    @property
    def seconds(self) -> float:
        """From plugging in to the first tracked sample, at a real device's pace."""
        return self.found_s + self.device_s


@dataclass(frozen=True, slots=True)
class Run:
    """One transport.

    Attributes:
        transport: its name.
        pluggings: each time.
        threads: left when the driver was closed.
        files: more than before it was opened.
        ended: what broke it off, or empty.
        load: of the machine, over the last minute.
    """

    transport: str
    pluggings: list[Plugging]
    threads: int
    files: int
    ended: str
    load: float


class Cable:
    """The tracker of the bed and the driver at its other end; time is the wall's."""

    def __init__(
        self, bed: RemoteBed, script: ScriptedDevice, driver: LighthouseDriver, pace: float
    ) -> None:
        self._bed, self._driver, self._pace = bed, driver, pace
        self._times = np.array([t for t, _, _ in script.reports])
        self.begun_s: float | None = None
        self._played = 0

    @property
    def device_s(self) -> float:
        """Of its time since its first report."""
        return float(self._times[max(self._played - 1, 0)] - self._times[0])

    def plug(self) -> None:
        self._bed.plug()
        self.begun_s, self._played = None, 0

    def unplug(self) -> None:
        self._bed.unplug()

    def wait(self, done: Callable[[TrackerSample], bool]) -> TrackerSample:
        """Let time pass until there is such a sample."""
        end_s = time.perf_counter() + PATIENCE_S
        while time.perf_counter() < end_s:
            self._send()
            for sample in self._driver.poll(time.perf_counter()):
                if done(sample):
                    return sample
            time.sleep(STEP_S)
        raise TimeoutError(f"no such sample within {PATIENCE_S:g} s")

    def _send(self) -> None:
        """What the device says by now; it begins when it is told to."""
        if self.begun_s is None and self._bed.sent():
            self.begun_s = time.perf_counter()
        if self.begun_s is not None:
            by_now = self._times[0] + (time.perf_counter() - self.begun_s) * self._pace
            due = int(np.searchsorted(self._times, by_now, side="right"))
            if due > self._played:
                self._bed.play(due - self._played)
                self._played = due


def is_tracked(sample: TrackerSample) -> bool:
    return sample.tracked and sample.state is TrackingState.OK


def is_gone(sample: TrackerSample) -> bool:
    return sample.state is TrackingState.GONE


def run(bed: RemoteBed, folder: Path, transport: str, times: int, pace: float) -> Run:
    """Open the driver, and pull the plug so many times."""
    (script,) = load_script(folder / SCRIPT)
    with LighthouseDriver(folder / STATIONS, transport):
        pass  # what libraries keep for good is there now
    files, pluggings = len(os.listdir("/proc/self/fd")), []
    with LighthouseDriver(folder / STATIONS, transport) as driver:
        cable = Cable(bed, script, driver, pace)
        cable.wait(is_tracked)
        ended = ""
        try:
            for _ in range(times):
                pluggings.append(replug(cable))
                save(folder, Run(transport, pluggings, 0, 0, CRASHED, os.getloadavg()[0]))
                print(f"{transport} {len(pluggings)}: {pluggings[-1]}", file=sys.stderr)
        except TimeoutError as error:
            ended = str(error)
    threads = [t for t in threading.enumerate() if t.name.startswith("lobstr")]
    more = len(os.listdir("/proc/self/fd")) - files
    return Run(transport, pluggings, len(threads), more, ended, os.getloadavg()[0])


def replug(cable: Cable) -> Plugging:
    """Once."""
    cable.unplug()
    cable.wait(is_gone)
    cable.plug()
    plugged_s = time.perf_counter()
    cable.wait(lambda sample: is_tracked(sample) and cable.begun_s is not None)
    assert cable.begun_s is not None
    return Plugging(cable.begun_s - plugged_s, cable.device_s)


def save(folder: Path, done: Run) -> None:
    (folder / RUN).write_text(json.dumps(asdict(done)), encoding="utf-8")


def inside(folder: Path, times: int, pace: float, transport: str) -> None:
    """Within the bed."""
    use_system_libusb()
    bed = RemoteBed()
    save(folder, run(bed, folder, transport, times, pace))
    bed.close()


def measure(times: int, seed: int, pace: float, transport: str) -> Run:
    """Run the bed, for one transport: what a crash leaves undone touches no other."""
    stations, model = room(2, seed), named(SERIAL)
    reports = reports_of(stations, model, carried(seed), LENGTH_S, seed=seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save_script([scripted_device(model, reports)], folder / SCRIPT)
        save_stations(folder / STATIONS, stations, {})
        save(folder, Run(transport, [], 0, 0, CRASHED, 0.0))
        bed = [str(SYSTEM_PYTHON), str(SUPPORT / "lighthouse_testbed.py"), str(folder / SCRIPT)]
        command = [sys.executable, __file__, INSIDE, name, str(times), str(pace), transport]
        subprocess.run([*bed, *command])
        r = json.loads((folder / RUN).read_text(encoding="utf-8"))
    return Run(**{**r, "pluggings": [Plugging(**p) for p in r["pluggings"]]})


TEXT = """{heading}

`python tools/lighthouse_replug.py --times {times} --seed {seed} --pace {pace:g}` on {date}.
A made-up tracker by cable in a made-up room with two Gen2 stations whose place is known, behind the
real libraries (umockdev). Found: until the driver, which looks once a second, has opened it, read
its configuration and told it to begin. Tracked: from its first report to the first tracked sample,
in its own time, which passed at {pace:g} of the wall's. The goal is {goal:g} s for both together.
Left: threads and open files after the driver was closed, more than before it was opened. Load:
of the machine's {cores} cores at the end, by this and by other work.

| transport | times | found (s, median) | tracked | both | most | within {goal:g} s | left | load |
|---|---|---|---|---|---|---|---|---|
{rows}
"""


def table(runs: Sequence[Run], args: argparse.Namespace) -> str:
    """The section of the results page."""
    return TEXT.format(
        heading=HEADING,
        times=args.times,
        seed=args.seed,
        pace=args.pace,
        date=datetime.date.today(),
        goal=GOAL_S,
        cores=os.cpu_count(),
        rows="\n".join(_line(run) for run in runs),
    )


def _line(run: Run) -> str:
    if not run.pluggings:
        return f"| {run.transport} | 0 | | | | | | {run.ended} | {run.load:.0f} |"
    found, device, both = (
        np.array([getattr(p, name) for p in run.pluggings])
        for name in ("found_s", "device_s", "seconds")
    )
    cells = [
        run.transport, f"{len(both)}", f"{np.median(found):.2f}", f"{np.median(device):.2f}",
        f"{np.median(both):.2f}", f"{both.max():.2f}", f"{np.mean(both <= GOAL_S):.0%}",
        run.ended or f"{run.threads} threads, {run.files} files", f"{run.load:.0f}",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    if sys.argv[1:2] == [INSIDE]:
        inside(Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]), sys.argv[5])
        return
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pace", type=float, default=1.0)
    parser.add_argument("--transport", action="append", default=[])
    parser.add_argument("--write", type=Path)
    args = parser.parse_args()
    transports = args.transport or [t.name for t in TRANSPORTS]
    runs = []
    for name in transports:
        runs.append(measure(args.times, args.seed, args.pace, name))
        print(_line(runs[-1]), flush=True)
        if args.write:
            write_section(table(runs, args), args.write)


if __name__ == "__main__":
    main()
