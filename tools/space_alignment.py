"""How well two tracking spaces are joined, by the function and by the wizard's step.

python tools/space_alignment.py [--write]
"""

import argparse
import datetime
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from results_page import write_section

from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.calibration.spaces import align_spaces
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import geodesic_angle, rotation_y
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.one_space import spaces_apart
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.runtime.wizard.flow import Wizard
from lobstr_hw.runtime.wizard.plan import steps_to_join
from lobstr_hw.runtime.wizard.run import TURN_S
from lobstr_hw.runtime.wizard.stage import Person
from lobstr_hw.simulation import TrackingErrors
from lobstr_hw.trackers import TrackerSample

sys.path.append(str(Path(__file__).parent.parent / "tests"))

from support.list_driver import ListDriver
from support.two_spaces import Scene, held_together

TITLE = "## Joining tracking spaces"
SEEDS = 24
DELAY_S = 0.005
LATE_S = 5.0
"""The two come together so late in the wizard's step."""
LIGHTHOUSE = TrackingErrors()
STEADY = replace(LIGHTHOUSE, drift_m=0.0, drift_rad=0.0)
LOOSE_M = 0.01


def by_function(scene: Scene) -> TrackingSpace | None:
    return align_spaces(scene.samples_a, scene.samples_b).space()


def by_wizard(scene: Scene) -> TrackingSpace | None:
    """They are taken in hand during the first seconds; None if the wizard is never content."""
    b = [_elsewhere(sample) for sample in scene.samples_b]
    parts = [("a", scene.samples_a, "A"), ("b", b, "B")]
    driver = ManyDrivers([PartDriver(ListDriver(s, {n: None}), name) for name, s, n in parts])
    world = spaces_apart(driver)
    assert world is not None
    wizard, now_s = Wizard(Person(), steps_to_join(world)), 0.0
    while not wizard.done and now_s < scene.samples_a[-1].time_s:
        now_s += TURN_S
        wizard.add(now_s, world.poll(now_s), (), world.devices())
    return world.spaces.get("b")


def _elsewhere(sample: TrackerSample) -> TrackerSample:
    """Swung about on its own before the two come together."""
    if sample.time_s >= LATE_S:
        return sample
    t = sample.time_s
    p = np.array([0.3 * np.sin(2.0 * t), 1.0, 0.2 * np.cos(3.0 * t)])
    return replace(sample, T_world_tracker=PartialPose(rotation_y(np.sin(3.0 * t)), p))


CASES: dict[str, tuple[Callable[[Scene], TrackingSpace | None], float, TrackingErrors, float]] = {
    "no errors": (by_function, 8.0, TrackingErrors.none(), 0.0),
    "Lighthouse errors without drift": (by_function, 8.0, STEADY, 0.0),
    "Lighthouse errors": (by_function, 8.0, LIGHTHOUSE, 0.0),
    "the wizard's step, taken in hand 5 s late": (by_wizard, 30.0, LIGHTHOUSE, 0.0),
    "the same, held so loosely that they slip by 1 cm": (by_wizard, 40.0, LIGHTHOUSE, LOOSE_M),
}


def row(name: str) -> str:
    join, seconds, errors, slip_m = CASES[name]
    off: list[tuple[float, float, float, float]] = []
    for seed in range(SEEDS):
        scene = held_together(seed, seconds=seconds, delay_s=DELAY_S, errors=errors, slip_m=slip_m)
        found = join(scene)
        if found is None:
            continue
        p_b = scene.T_a_b.inverse().apply(scene.p_mean)
        off_mm = 1e3 * float(np.linalg.norm(found.T_world_space.apply(p_b) - scene.p_mean))
        turned = float(np.rad2deg(geodesic_angle(found.T_world_space.R, scene.T_a_b.R)))
        off.append((off_mm, turned, 1e3 * abs(found.delay_s - DELAY_S), 1e3 * found.residual_m))
    (mm, degrees, _, told), (mm_most, degrees_most, ms_most, _) = np.median(off, 0), np.max(off, 0)
    return (
        f"| {name} | {len(off)} of {SEEDS} | {mm:.2f}, {mm_most:.2f} mm | {degrees:.3f}, "
        f"{degrees_most:.3f} degrees | {ms_most:.2f} ms | {told:.1f} mm |"
    )


def section() -> str:
    date = datetime.datetime.now(tz=datetime.UTC).date()
    rows = "\n".join(row(name) for name in CASES)
    return f"""{TITLE}

Two trackers, one of each system, are held together and turned by some 30 degrees about each axis;
the one driver stamps {1e3 * DELAY_S:.0f} ms later than the other. {SEEDS} seeds. The error of the
place is that where they were moved: median and worst. `residual`: what is told to the person,
median.

`python tools/space_alignment.py`, {date}.

| | joined | place | rotation | delay: worst | residual |
|---|---|---|---|---|---|
{rows}
"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    text = section()
    print(text)
    if options.write:
        write_section(text)
