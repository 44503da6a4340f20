"""How well two tracking spaces are joined: the table in docs/devices.md.

python tools/space_alignment.py
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from lobstr_hw.calibration.spaces import align_spaces
from lobstr_hw.rotations import geodesic_angle
from lobstr_hw.simulation import TrackingErrors

sys.path.append(str(Path(__file__).parent.parent / "tests"))

from support.two_spaces import held_together

SEEDS = 24
DELAY_S = 0.005
LIGHTHOUSE = TrackingErrors()
STEADY = replace(LIGHTHOUSE, drift_m=0.0, drift_rad=0.0)
CASES = {
    "no errors": TrackingErrors.none(),
    "Lighthouse errors without drift": STEADY,
    "Lighthouse errors": LIGHTHOUSE,
}


def row(name: str, errors: TrackingErrors) -> str:
    off = []
    for seed in range(SEEDS):
        scene = held_together(seed, delay_s=DELAY_S, errors=errors)
        found = align_spaces(scene.samples_a, scene.samples_b)
        p_b = scene.T_a_b.inverse().apply(scene.p_mean)
        off_mm = 1e3 * np.linalg.norm(found.T_a_b.apply(p_b) - scene.p_mean)
        turned = np.rad2deg(geodesic_angle(found.T_a_b.R, scene.T_a_b.R))
        off.append((off_mm, turned, 1e3 * abs(found.delay_s - DELAY_S)))
    (mm, degrees, _), (mm_most, degrees_most, ms_most) = np.median(off, 0), np.max(off, 0)
    return (
        f"| {name} | {mm:.2f}, {mm_most:.2f} mm | {degrees:.3f}, {degrees_most:.3f} degrees | "
        f"{ms_most:.2f} ms |"
    )


if __name__ == "__main__":
    for name, errors in CASES.items():
        print(row(name, errors), flush=True)
