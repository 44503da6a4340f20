"""Make the bundled demo log from motion clips of one actor (runtime/demo/NOTICE.md).

    python tools/make_demo_log.py DATA

DATA holds the folders snu_tiling_patch and snu_ys2010, each with its clips and manifest.csv. Only
clips that no training saw are used (part test_same_actor of the default split), so the demo does
not flatter. The order of the parts is the one that stays in the smallest square.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lobstr_hw.bvh_writer import write_bvh
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.runtime.commands.log import main as lobstr_log
from lobstr_hw.simulation import joined

ROOT = Path(__file__).resolve().parent.parent
SETS = ("snu_tiling_patch", "snu_ys2010")
SPLIT = ROOT / "lobstr_hw" / "training" / "splits" / "default.json"
LARGEST_BYTES = 3_000_000
LARGEST_M = 3.3
SEED, HEIGHT_CM = 72, 172


@dataclass(frozen=True, slots=True)
class Part:
    """A stretch of a clip (``#0``: its first good piece), both feet on the floor at both ends."""

    clip: str
    start_s: float
    end_s: float


PARTS = (
    Part("snu_tiling_patch/1_throw_ball#0", 12.5, 20.7),  # standing, gestures, arms overhead
    Part("snu_tiling_patch/1_walk_clockwise", 16.76, 29.4),  # walking, turning all the time
    Part("snu_ys2010/Samsung_wd2_tt_freegame", 9.9, 17.75),  # side steps
    Part("snu_tiling_patch/1_move_to_high", 0.3, 10.2),  # reaching up, turning about
    Part("snu_ys2010/Physics2_wd2_WalkBackward03", 0.8, 7.0),  # walking backward
    Part("snu_tiling_patch/1_chair", 0.3, 12.2),  # walking up, sitting down, standing up
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, metavar="DATA", help="folder of the two sets")
    parser.add_argument("--out", type=Path, default=ROOT / "runtime" / "demo" / "demo.mcap")
    parser.add_argument("--keep-bvh", type=Path, metavar="FILE", help="keep the joined clip too")
    options = parser.parse_args()
    check_held_out()
    motion = joined(list(cut_parts(options.data)))
    size = np.ptp(motion.p_hips[:, [0, 2]], axis=0)
    print(f"{motion.duration_s:.1f} s in {size[0]:.2f} x {size[1]:.2f} m")
    if size.max() > LARGEST_M:
        raise SystemExit(f"leaves the play area of {LARGEST_M} m: choose another order of parts")
    with tempfile.TemporaryDirectory() as folder:
        bvh = options.keep_bvh or Path(folder) / "demo.bvh"
        write_bvh(bvh, motion.p_hips, motion.R_local, motion.rate_hz)
        make = ["make", str(bvh), str(options.out)]
        if lobstr_log([*make, "--seed", str(SEED), "--height", str(HEIGHT_CM)]):
            return 1
    if options.out.stat().st_size > LARGEST_BYTES:
        raise SystemExit(f"{options.out} is larger than {LARGEST_BYTES} bytes: leave out a part")
    return lobstr_log(["info", str(options.out)])


def check_held_out() -> None:
    """No part may come from a clip that was trained on."""
    held_out = set(json.loads(SPLIT.read_text(encoding="utf-8"))["test_same_actor"])
    seen = {part.clip.partition("#")[0] for part in PARTS} - held_out
    if seen:
        raise SystemExit(f"not held out of training: {', '.join(sorted(seen))}")


def cut_parts(data: Path) -> Iterator[Motion]:
    """The parts on the standard skeleton.

    All clips of the actor are read, for the canonical frames are fitted from them together.
    """
    wanted = {part.clip for part in PARTS}
    clips = find_clips([data / name for name in SETS])
    motions = {m.name: m for m in retarget(clips) if m.name in wanted}
    for part in PARTS:
        motion = motions[part.clip]
        rows = slice(round(part.start_s * motion.rate_hz), round(part.end_s * motion.rate_hz) + 1)
        yield replace(
            motion,
            p_hips=motion.p_hips[rows],
            R_local=motion.R_local[rows],
            p_toes=motion.p_toes[rows],
        )


if __name__ == "__main__":
    sys.exit(main())
