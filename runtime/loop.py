"""The loop, as the paper's Figure 3 draws it."""

from collections.abc import Callable, Iterable, Sequence

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.runtime.session import Session
from lobstr_hw.runtime.ticks import Tick
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["run", "take_in"]

Control = Callable[[Tick, Sequence[TrackerSample]], None]


def run(
    driver: TrackerDriver,
    feed: Feed,
    session: Session,
    outputs: Sequence[Output],
    ticks: Iterable[Tick],
    observe: Callable[[Tick, SkeletonPose], None],
    control: Control | None = None,
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
        samples = take_in(tick, driver, feed, session, outputs, control)
        pose = session.step(tick, feed)
        for output in outputs:
            output.send(pose, samples)
        observe(tick, pose)


def take_in(
    tick: Tick,
    driver: TrackerDriver,
    feed: Feed,
    session: Session,
    outputs: Sequence[Output] = (),
    control: Control | None = None,
) -> Sequence[TrackerSample]:
    """What a tick brings, up to the body: samples, the first calibration, gestures."""
    samples = driver.poll(tick.time_s)
    feed.add(samples)
    if session.calibrate(samples):
        feed.table.bind(session.roles)
        for output in outputs:
            output.calibrated(session.body)
    if control is not None:
        control(tick, samples)
    return samples
