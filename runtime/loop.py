"""The loop, as the paper's Figure 3 draws it."""

from collections.abc import Callable, Iterable, Sequence

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.runtime.session import Session
from lobstr_hw.runtime.ticks import Tick
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["run"]


def run(
    driver: TrackerDriver,
    feed: Feed,
    session: Session,
    outputs: Sequence[Output],
    ticks: Iterable[Tick],
    observe: Callable[[Tick, SkeletonPose], None],
    control: Callable[[Tick, Sequence[TrackerSample]], None] | None = None,
) -> None:
    """Trackers -> reference frame -> velocity -> GRU -> contact IK -> outputs.

    Args:
        driver: an open source of samples.
        feed: sorts the samples by role.
        session: the user's calibration and avatar.
        outputs: open; told once when the user's sizes are known.
        ticks: when to run, and at which times the predictor steps.
        observe: sees every tick and the pose that was sent (status line, summary).
        control: obeys the user's gestures before the body is made.
    """
    for tick in ticks:
        samples = driver.poll(tick.time_s)
        feed.add(samples)
        if session.calibrate(samples):
            feed.table.bind(session.roles)
            for output in outputs:
                output.calibrated(session.body)
        if control is not None:
            control(tick, samples)
        pose = session.step(tick, feed)
        for output in outputs:
            output.send(pose, samples)
        observe(tick, pose)
