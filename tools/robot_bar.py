"""Two trackers on one rigid bar: how constant is the distance between them?

    python tools/robot_bar.py FOLDER [--write docs/results.md]

FOLDER holds libsurvive recordings, dyn_*.rec.gz (the bar is carried about by a robot) and
static_*.rec.gz. The stations are solved from the first moving one and used for all. The trackers'
clocks are brought together by the stations: both trackers see the syncs of the same rotors, and the
bits in them tell which turn is which.
"""

import argparse
import datetime
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from results_page import write_section

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Ints
from lobstr_hw.drivers.lighthouse.gen2 import PERIODS
from lobstr_hw.drivers.lighthouse.light import Stations
from lobstr_hw.drivers.lighthouse.recorded_tracking import (
    RecordedTake,
    read_takes,
    solve_takes,
    track_takes,
)
from lobstr_hw.drivers.lighthouse.station_solve import StationSolution
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracker import Fix
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    geodesic_angle,
    rotation_mean,
    to_rotation_vector,
)

HEADING = "## Lighthouse: two trackers on a robot's bar"
LENGTH_M = 0.2675
"""Nobody measured it; SteamVR's mean over 50 poses."""
SETTLED_S = 2.0
"""After both are tracked."""
LONGEST_STEP_S = 0.02
"""Between two poses of a tracker, for a pose between them."""
STD_MM, MEAN_MM, STATIC_MM, TURN_DEGREES = 5.0, 6.0, 5.0, 1.0
SHARED_TURNS = 50


@dataclass(frozen=True, slots=True)
class Bar:
    """One recording.

    Attributes:
        name: of the file.
        seconds: compared.
        poses: of the first tracker, each compared to the second's at the same moment.
        compared: share of the poses from 2 s after both are tracked that could be.
        mean_mm, std_mm: distance.
        turn_degrees: relative rotation off its mean, at most.
        clock_us: spread of the stations' syncs about the line between the two clocks.
    """

    name: str
    seconds: float
    poses: int
    compared: float
    mean_mm: float
    std_mm: float
    turn_degrees: float
    clock_us: float


def clock_line(a: RecordedTake, b: RecordedTake) -> tuple[Array, float]:
    """Ticks of b less ticks of a, as a line over ticks of a; and the spread about it in ticks."""
    syncs_a, syncs_b = a.recording.events.syncs, b.recording.events.syncs
    moments, offsets = [], []
    for channel in np.intersect1d(syncs_a[:, 0], syncs_b[:, 0]).tolist():
        mine = [s[s[:, 0] == channel] for s in (syncs_a, syncs_b)]
        i, j = _same_turns(mine[0], mine[1], PERIODS[channel])
        moments.append(mine[0][i, 1])
        offsets.append(mine[1][j, 1] - mine[0][i, 1])
    # a frame of bits repeats after 9 s: of stations that turn at different speeds one offset agrees
    middle = np.median(np.concatenate(offsets))
    ticks, offset = np.concatenate(moments), np.concatenate(offsets)
    near = np.abs(offset - middle) < TICKS_PER_S // 1000
    line = np.polyfit(ticks[near], offset[near], 1)
    return line, float(np.std(offset[near] - np.polyval(line, ticks[near])))


def _same_turns(a: Ints, b: Ints, period: int) -> tuple[Ints, Ints]:
    """Rows of two trackers' syncs of one station that are of the same turns, by their bits."""
    turn_a, turn_b = (np.round((s[:, 1] - s[0, 1]) / period).astype(np.int64) for s in (a, b))
    best, rows = 0.0, (np.zeros(0, np.int64), np.zeros(0, np.int64))
    for shift in range(-int(turn_b[-1]), int(turn_a[-1]) + 1):
        _, i, j = np.intersect1d(turn_a, turn_b + shift, return_indices=True)
        if len(i) < SHARED_TURNS:
            continue
        agree = np.mean(a[i, 2] == b[j, 2]) * np.sqrt(len(i) / len(turn_a))
        if agree > best:
            best, rows = float(agree), (i, j)
    return rows


def compare(takes: list[RecordedTake], stations: Stations, name: str) -> Bar:
    """The bar in one recording."""
    a, b = track_takes(takes, stations)
    line, spread = clock_line(takes[0], takes[1])
    at = a.ticks + np.polyval(line, a.ticks)
    p, R, there = _between(b, at)
    good = there & (a.fix == Fix.LIGHT)
    settled = a.ticks > a.ticks[np.argmax(good)] + SETTLED_S * TICKS_PER_S
    use = good & settled
    distance = 1e3 * np.linalg.norm(p - a.p, axis=1)[use]
    turn = (np.swapaxes(a.R, 1, 2) @ R)[use]
    off = np.degrees(geodesic_angle(turn, rotation_mean(turn)))
    return Bar(
        name,
        float(np.ptp(a.ticks[use])) / TICKS_PER_S,
        int(np.count_nonzero(use)),
        float(np.count_nonzero(use) / np.count_nonzero(settled)),
        float(distance.mean()),
        float(distance.std()),
        float(off.max()),
        1e6 * spread / TICKS_PER_S,
    )


def _between(poses: TimedPoses, at: Array) -> tuple[Array, Array, Array]:
    """Position and rotation at moments (in ticks), and whether both neighbours are by light."""
    j = np.clip(np.searchsorted(poses.ticks, at), 1, len(poses) - 1)
    step = poses.ticks[j] - poses.ticks[j - 1]
    f = ((at - poses.ticks[j - 1]) / step)[:, None]
    lit = (poses.fix[j] == Fix.LIGHT) & (poses.fix[j - 1] == Fix.LIGHT)
    there = lit & (f[:, 0] >= 0) & (f[:, 0] <= 1) & (step < LONGEST_STEP_S * TICKS_PER_S)
    turn = np.swapaxes(poses.R[j - 1], 1, 2) @ poses.R[j]
    f = np.clip(f, 0.0, 1.0)
    R = poses.R[j - 1] @ from_rotation_vector(f * to_rotation_vector(turn))
    return (1.0 - f) * poses.p[j - 1] + f * poses.p[j], R, there


def is_within(bar: Bar) -> bool:
    """Whether it meets what is asked."""
    off = abs(bar.mean_mm - 1e3 * LENGTH_M)
    moving = bar.name.startswith("dyn")
    near = off <= MEAN_MM and bar.std_mm <= STD_MM if moving else off <= STATIC_MM
    return near and bar.turn_degrees <= TURN_DEGREES


def section(bars: list[Bar], solution: StationSolution, source: str) -> str:
    """The section of docs/results.md."""
    residual = ", ".join(f"{1e3 * r:.3f}" for r in solution.residual_rad.values())
    lines = [
        HEADING,
        "",
        "Two Vive Trackers 2018 screwed to one bar on a robot arm, two Gen2 base stations"
        " (recordings by M. Gravert). Their distance and relative rotation are constant by"
        f" construction; the length nobody measured, SteamVR's mean over 50 poses is"
        f" {1e3 * LENGTH_M:.1f} mm (with a standard deviation of 4.9 mm; libsurvive 35 to 45 mm)."
        f" Stations solved from `{source}` alone (median residuals {residual} mrad). Each pose of"
        " one tracker against the other's at the same moment, both by light, from 2 s after both"
        " are tracked; the two clocks are brought together by the stations' syncs.",
        "",
        "Asked: moving: standard deviation at most 5 mm, mean within 6 mm; at rest within 5 mm;"
        " rotation within 1 degree.",
        "",
        f"`python tools/robot_bar.py lighthouse/robot-bar`, {datetime.date.today().isoformat()}.",
        "",
        "| recording | seconds | poses | of all % | distance mm | off mm | standard deviation mm |"
        " rotation off its mean, most, degrees | clocks, µs | as asked |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {b.name} | {b.seconds:.1f} | {b.poses} | {100 * b.compared:.1f} | {b.mean_mm:.2f} |"
        f" {b.mean_mm - 1e3 * LENGTH_M:+.2f} | {b.std_mm:.2f} | {b.turn_degrees:.2f} |"
        f" {b.clock_us:.2f} | {'yes' if is_within(b) else 'no'} |"
        for b in bars
    ]
    return "\n".join([*lines, ""])


def main() -> int:
    """Print the section, write it where asked; fail where the bar is not as asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", type=Path, help="a file with such a section, to be replaced")
    asked = parser.parse_args()
    paths = sorted(asked.folder.glob("*.rec.gz"))
    moving = [path for path in paths if path.name.startswith("dyn")]
    if not moving:
        parser.error("no dyn_*.rec.gz in this folder")
    solution = solve_takes(read_takes(moving[0]))
    bars = [
        compare(read_takes(path), solution.stations, path.name.removesuffix(".rec.gz"))
        for path in paths
    ]
    text = section(bars, solution, moving[0].name.removesuffix(".rec.gz"))
    print(text)
    if asked.write is not None:
        write_section(text, asked.write)
    return 0 if all(map(is_within, bars)) else 1


if __name__ == "__main__":
    sys.exit(main())
