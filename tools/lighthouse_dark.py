"""Recorded Lighthouse devices at rest and without light: jitter, dead reckoning, coming back.

    python tools/lighthouse_dark.py FILE... [--room FILE] [--write docs/results.md]

Stations are solved from each file; from --room for those that lie in the same folder.
Each device is tracked as recorded, and again with all of its light taken out for a second, at a
few places; where it was meanwhile, the first track tells.
"""

import argparse
import datetime
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from results_page import write_section

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Ints
from lobstr_hw.drivers.lighthouse.light import Flags, Stations
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.recorded_tracking import RecordedTake, read_takes, solve_takes
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.tracker import Fix

HEADING = "## Lighthouse: at rest and in the dark"
DARK_S = 1.0
PLACES = (0.35, 0.55, 0.75)
"""Of a recording's length, where the light is taken out."""
REST_S = 1.0


@dataclass(frozen=True, slots=True)
class Rest:
    """One device of one recording.

    Attributes:
        name, serial: of the file and the device.
        seconds: it was tracked.
        posed: share of the IMU samples since the first pose that have one at their own time.
        tracked: share of those poses that are not LOST.
        rest_s: it lay still, in stretches of a second and more.
        jitter_mm: rms about the mean of each such second, the median of them, and
        jitter_worst_mm: the largest.
        speed: the largest there, m/s.
    """

    name: str
    serial: str
    seconds: float
    posed: float
    tracked: float
    rest_s: float
    jitter_mm: float
    jitter_worst_mm: float
    speed: float


@dataclass(frozen=True, slots=True)
class Dark:
    """A second without light.

    Attributes:
        tracked_ms: from the last hit until it says that it does not know any more.
        off_mm: how far it was off the track with light while it said it knew.
        held_mm: how far its place moved while it was lost.
        back_ms: from the first hit until it is tracked for good; infinity: not within a second.
        off_back_mm: how far off the track with light it was then, at most, for a second.
    """

    tracked_ms: float
    off_mm: float
    held_mm: float
    back_ms: float
    off_back_mm: float


def follow(take: RecordedTake, stations: Stations, events: RawEvents) -> TimedPoses:
    """The poses of a device by some of its events."""
    device = TrackedDevice(take.model, stations, take.recording.ranges)
    device.feed_events(events)
    return device.poses()


def without_light(events: RawEvents, since: int, until: int) -> RawEvents:
    """Events without pulses and sweeps of some time."""

    def lit(ticks: Ints) -> Flags:
        return np.asarray((ticks < since) | (ticks > until))

    sweeps = lit(events.sweeps[:, 2])
    return replace(
        events,
        pulses=events.pulses[lit(events.pulses[:, 1])],
        sweeps=events.sweeps[sweeps],
        syncs_before=events.syncs_before[sweeps],
    )


def rest_of(take: RecordedTake, poses: TimedPoses) -> Rest:
    """How a device does that is seen."""
    lies = ~np.any(poses.velocity, axis=1) & (poses.fix == Fix.LIGHT)
    seconds = [s for s in _stretches(poses, lies)]
    jitter = [
        1e3 * float(np.sqrt(np.mean(np.sum((p - p.mean(axis=0)) ** 2, axis=1))))
        for p in (poses.p[s] for s in seconds)
    ]
    imu = take.take.imu.ticks
    since = imu[imu >= poses.ticks[0]]
    fast = [np.linalg.norm(poses.velocity[s], axis=1).max() for s in seconds]
    return Rest(
        take.path.name.split(".")[0],
        take.model.serial,
        float(poses.ticks[-1] - poses.ticks[0]) / TICKS_PER_S,
        len(poses) / max(int(np.count_nonzero(since <= poses.ticks[-1])), 1),
        float(np.mean(poses.tracked)),
        REST_S * len(seconds),
        float(np.median(jitter)) if jitter else float("nan"),
        max(jitter, default=float("nan")),
        float(max(fast, default=float("nan"))),
    )


def _stretches(poses: TimedPoses, lies: Flags) -> Iterator[slice]:
    """Whole seconds in which it lay still all the time."""
    step = int(REST_S * TICKS_PER_S)
    for begin in range(int(poses.ticks[0]), int(poses.ticks[-1]) - step, step):
        i, j = np.searchsorted(poses.ticks, [begin, begin + step])
        if j - i > 10 and lies[i:j].all():
            yield slice(int(i), int(j))


def darken(take: RecordedTake, stations: Stations, lit: TimedPoses, place: float) -> Dark | None:
    """Take the light out at a place; None: it was not tracked there to begin with."""
    first, last = int(lit.ticks[0]), int(lit.ticks[-1])
    since = int(first + place * (last - first))
    until = since + int(DARK_S * TICKS_PER_S)
    i, j = np.searchsorted(lit.ticks, [since - TICKS_PER_S // 2, until + TICKS_PER_S])
    if j >= len(lit) or np.any(lit.fix[i:j] != Fix.LIGHT):
        return None
    hits = take.take.angles.ticks
    before, after = hits[hits < since][-1], hits[hits > until][0]
    dark = follow(take, stations, without_light(take.recording.events, since, until))
    same = np.isin(dark.ticks, lit.ticks)
    dark_at = np.flatnonzero(same)
    lit_at = np.searchsorted(lit.ticks, dark.ticks[dark_at])
    off = 1e3 * np.linalg.norm(dark.p[dark_at] - lit.p[lit_at], axis=1)
    t = (dark.ticks[dark_at] - since) / TICKS_PER_S
    known = dark.tracked[dark_at]
    in_dark = (t > 0) & (t < DARK_S)
    lost = dark.p[dark_at][in_dark & ~known]
    later = np.flatnonzero((t >= DARK_S) & (t < 2 * DARK_S))
    missing = np.flatnonzero(~known[later])
    back = later[missing[-1] + 1] if len(missing) and missing[-1] + 1 < len(later) else later[0]
    came = not len(missing) or missing[-1] + 1 < len(later)
    told = dark.ticks[dark_at[in_dark & known]]
    return Dark(
        1e3 * float(told[-1] - before) / TICKS_PER_S if len(told) else 0.0,
        float(off[in_dark & known].max(initial=0.0)),
        1e3 * float(np.ptp(lost, axis=0).max()) if len(lost) else 0.0,
        1e3 * float(dark.ticks[dark_at[back]] - after) / TICKS_PER_S if came else float("inf"),
        float(off[back : later[-1] + 1].max()) if came else float("nan"),
    )


def section(rests: list[Rest], darks: dict[str, list[Dark]], command: str) -> str:
    """The section of docs/results.md."""
    lines = [
        HEADING,
        "",
        "Recordings of real devices. At rest: rms about the mean of every second in which the"
        " tracker holds the device to lie still. In the dark: all light of a second is taken out"
        f" of the recording ({len(PLACES)} places each, where it is tracked); off: against the"
        " track with light. Asked: jitter at most 0.3 mm; not tracked after 100 ms at most, never"
        " a fly-off; back within 200 ms of light.",
        "",
        f"`{command}`, {datetime.date.today().isoformat()}.",
        "",
        "| recording | device | seconds | samples with a pose % | tracked % | at rest s |"
        " jitter mm, median / worst second | speed at rest m/s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.name} | {r.serial} | {r.seconds:.1f} | {100 * r.posed:.1f} |"
        f" {100 * r.tracked:.1f} | {r.rest_s:.0f} | {r.jitter_mm:.3f} /"
        f" {r.jitter_worst_mm:.3f} | {r.speed:.3f} |"
        for r in rests
    ]
    lines += [
        "",
        "| recording, device | dark seconds | tracked on, ms, most | off meanwhile, mm, most |"
        " moved while lost, mm | back after, ms, most | off then, mm, most |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {len(d)} | {max(x.tracked_ms for x in d):.0f} |"
        f" {max(x.off_mm for x in d):.1f} | {max(x.held_mm for x in d):.1f} |"
        f" {max(x.back_ms for x in d):.0f} | {max(x.off_back_mm for x in d):.1f} |"
        for name, d in darks.items()
        if d
    ]
    return "\n".join([*lines, ""])


def main() -> int:
    """Print the section; write it where asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    parser.add_argument("--room", type=Path, metavar="FILE", help="recording to solve stations by")
    parser.add_argument("--write", type=Path, help="a file with such a section, to be replaced")
    asked = parser.parse_args()
    room = solve_takes(read_takes(asked.room)).stations if asked.room else None
    rests: list[Rest] = []
    darks: dict[str, list[Dark]] = {}
    for path in asked.files:
        takes = read_takes(path)
        known = room if asked.room and path.parent == asked.room.parent else None
        stations = known or solve_takes(takes).stations
        for take in takes:
            lit = follow(take, stations, take.recording.events)
            if len(lit) < 10:
                continue
            rests.append(rest_of(take, lit))
            found = [darken(take, stations, lit, place) for place in PLACES]
            darks[f"{rests[-1].name}, {take.model.serial}"] = [d for d in found if d is not None]
            print(rests[-1], found, file=sys.stderr, flush=True)
    names = " ".join(path.name for path in asked.files)
    command = f"python tools/lighthouse_dark.py {names}"
    command += f" --room {asked.room.name}" if asked.room else ""
    text = section(rests, darks, command)
    print(text)
    if asked.write is not None:
        write_section(text, asked.write)
    return 0


if __name__ == "__main__":
    sys.exit(main())
