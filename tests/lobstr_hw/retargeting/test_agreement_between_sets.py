"""Sets of real motion agree after retargeting (LOBSTR_DATA names the folder they lie in)."""

import os
from pathlib import Path

import pytest

from lobstr_hw.retargeting import ClipFile, find_clips, retarget
from lobstr_hw.retargeting.agreement import Gait, measure, table

ENOUGH_S = 5.0
"""Less walking than this says more about the clip than about the rig."""
CLIPS = 12


def some(clips: list[ClipFile]) -> list[ClipFile]:
    """A dozen of a set, spread evenly; walks where there are any."""
    clips = [c for c in clips if "walk" in c.category or "sport" in c.category] or clips
    return clips[:: max(1, len(clips) // CLIPS)]


@pytest.fixture(scope="module")
def gaits() -> dict[str, Gait]:
    folder = os.environ.get("LOBSTR_DATA")
    if not folder or not any(Path(folder).rglob("*.bvh")):
        pytest.skip("set LOBSTR_DATA to the folder of unpacked motion sets to run this")
    sets: dict[str, list[ClipFile]] = {}
    for clip in find_clips([folder]):
        sets.setdefault(clip.set_name, []).append(clip)
    motions = (m for clips in sets.values() for m in retarget(some(clips)))
    found = {name: g for name, g in measure(motions).items() if g.walking_s > ENOUGH_S}
    assert len(found) >= 2, f"nothing to compare in {folder}"
    print(table(found))
    return found


BOUNDS = {  # docs/retargeting.md has the table for all clips
    "thigh_pitch": (9.0, 17.0),
    "thigh_swing": (12.0, 20.0),
    "knee_flexion": (31.0, 42.0),
    "knee_off_hinge": (0.0, 0.01),
    "pelvis_pitch": (-3.0, 3.0),
    "head_pitch": (-5.0, 5.0),
    "foot_heading": (-6.0, 20.0),
    "foot_pitch": (-1.0, 6.0),
    "toe_ahead": (-1.0, 8.0),
    "stance_toe": (1.6, 3.0),
    "toe_error_mm": (0.0, 1.0),
}
ODD = {
    # its left knee is 13 degrees straighter than its right, in the rig
    "snu_cmu69_cmu94": {"thigh_pitch": (6.0, 17.0), "knee_flexion": (24.0, 42.0)},
    # stealthy walks by nobody knows whom
    "deepmimic": {"thigh_pitch": (4.0, 17.0), "knee_flexion": (22.0, 42.0)},
    # a few steps between kicks, its toe base 5 cm further from the ankle than ours
    "snu_martial_arts": {
        "thigh_swing": (9.0, 20.0),
        "knee_flexion": (20.0, 42.0),
        "toe_ahead": (0.0, 14.0),
        "toe_error_mm": (0.0, 5.0),
    },
}


@pytest.mark.parametrize("what", BOUNDS)
def test_walking_means_the_same_on_every_rig(gaits: dict[str, Gait], what: str) -> None:
    out = {}
    for name, gait in gaits.items():
        low, high = ODD.get(name, {}).get(what, BOUNDS[what])
        if not low <= getattr(gait, what) <= high:
            out[name] = getattr(gait, what)
    assert not out, f"{what} should be {BOUNDS[what]}: {out}"
