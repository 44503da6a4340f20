"""A whole live session: samples, a user, an avatar, outputs, and the loop that joins them."""

import gc
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from lobstr_hw.avatar import AHEAD
from lobstr_hw.drivers.driver import DeviceEvent, TrackerDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.errors import OutputError
from lobstr_hw.predictors import load_predictor
from lobstr_hw.runtime.calibrating import TPoseWatcher
from lobstr_hw.runtime.clock import Clock, HostClock
from lobstr_hw.runtime.controls import Controls, Say
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.loop import run
from lobstr_hw.runtime.one_space import in_one_space
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.runtime.outputs.queued import QueuedOutput
from lobstr_hw.runtime.outputs.sinks import SessionFacts, SinkSpec, make_output
from lobstr_hw.runtime.profiles import chosen_profile
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.runtime.session import Session
from lobstr_hw.runtime.status import Snapshot, StatusLine
from lobstr_hw.runtime.summary import Summary, Tally
from lobstr_hw.runtime.ticks import INPUT_DELAY_S, Grid, Tick, Ticks
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["LiveOptions", "LiveSession"]

COLLECT_EVERY = 4096
"""Ticks between two garbage collections: cheap, for all that was there before is frozen."""

Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class LiveOptions:
    """What the user asked for.

    Attributes:
        profile: calibration profile; None waits for a T-pose.
        predictor: name or weights file.
        rate_hz: of the loop.
        input_delay_s: of the predictor's grid behind the ticks.
        outputs: the sinks.
        take: name of this recording.
        duration_s: from the first tick; None goes on until the source or the user ends it.
        fast: as fast as possible on the log's clock.
        quiet: no status line.
    """

    profile: Path | None = None
    predictor: str = "lobstr"
    rate_hz: float = 45.0
    input_delay_s: float = INPUT_DELAY_S
    outputs: tuple[SinkSpec, ...] = ()
    take: str = "take"
    duration_s: float | None = None
    fast: bool = False
    quiet: bool = False


class LiveSession:
    """Everything that one run needs, made in the order in which it can fail.

    ``with LiveSession(...) as live: live.run(stop)``; leaving it closes driver and outputs.

    Attributes:
        source: the driver, with all samples in one space.
        session: the user's calibration and avatar.
        feed: the trackers by role.
        outputs: open ones; a caller may add its own, which it closes itself.
        ticks, tally: what the summary is made of.
    """

    def __init__(
        self,
        driver: TrackerDriver,
        options: LiveOptions,
        tell: Tell,
        clock: Clock | None = None,
        say: Say | None = None,
    ) -> None:
        """Get ready; nothing is opened before ``with``.

        Args:
            driver: where samples come from; a :class:`ReplayDriver` ends the session with its log.
            options: what the user asked for.
            tell: is given each message for the user.
            clock: for tests; the machine's otherwise.
            say: is given what somebody in a headset should hear; nobody listens if None.
        """
        self.driver = driver
        self.options = options
        self.tell = tell
        self.say: Say = say or (lambda spoken: None)
        self.clock = clock or HostClock()
        self.outputs: list[Output] = []
        self._queues: list[QueuedOutput] = []
        self._listeners: list[Callable[[DeviceEvent], None]] = []
        self._open = ExitStack()
        self._pose: SkeletonPose | None = None

    def __enter__(self) -> "LiveSession":
        """Load, open and check everything.

        Raises:
            LobstrError: whatever is missing; what was open is closed again.
        """
        with self._open:
            self._build()
            self._open = self._open.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        """Write what is left and close everything."""
        self._open.close()

    def _build(self) -> None:
        options = self.options
        predictor = load_predictor(options.predictor)
        self._open.enter_context(self.driver)
        profile = chosen_profile(options.profile, self.driver, self.tell)
        spaces = {} if profile is None else profile.tracking_spaces
        self.source = in_one_space(self.driver, spaces, self.tell)
        table = RoleTable(None if profile is None else profile.roles, self.driver.devices)
        self.feed = Feed(predictor.card.accepts, table)
        self.watcher = TPoseWatcher(table)
        self.session = Session(
            predictor,
            self.watcher,
            profile,
            rate_hz=options.rate_hz,
            input_delay_s=options.input_delay_s,
        )
        if isinstance(self.driver, ReplayDriver):
            self._check_log(self.driver)
        self.controls = Controls(self.driver, self.session, self.feed, self.say, self._hear)
        grid = Grid(options.rate_hz, predictor.card.rate_hz, 0.0, options.input_delay_s)
        self.ticks = Ticks(
            options.rate_hz, grid, 0.0, self.clock, paced=not options.fast, last=self._last_tick()
        )
        self.tally = Tally(options.rate_hz)
        self._open_outputs(table)

    def _check_log(self, driver: ReplayDriver) -> None:
        if driver.log.damage:
            self.tell(
                f"{driver.path}: {driver.log.damage}; going on with the "
                f"{driver.duration_s:.1f} s that can be read. To keep them: "
                f"lobstr-log repair {driver.path}"
            )
        needs = self.session.predictor.card.needs if self.session.calibrated else FOUR_POINTS
        self.feed.table.require(needs)

    def _end_s(self) -> float | None:
        """Session time at which it is over by itself."""
        ends = [self.options.duration_s]
        if isinstance(self.driver, ReplayDriver):
            ends.append(self.driver.duration_s)
        return min((end for end in ends if end is not None), default=None)

    def _last_tick(self) -> int | None:
        end_s = self._end_s()
        # logs round times down to whole nanoseconds
        return None if end_s is None else int(end_s * self.options.rate_hz + 1e-6)

    def _open_outputs(self, table: RoleTable) -> None:
        facts = SessionFacts(table.of, self._unix_offset_s, self.tell, self._listeners.append)
        for spec in self.options.outputs:
            self._spare_the_log(spec)
            output = make_output(spec, facts)
            output.open(self.session.body, self.options.rate_hz, self.options.take)
            self._open.callback(output.close)
            self.outputs.append(output)
            self._queues.append(output)
            if self.session.calibrated:
                output.calibrated(self.session.body)

    def _hear(self, event: DeviceEvent) -> None:
        for listener in self._listeners:
            listener(event)

    def _unix_offset_s(self, now_s: float) -> float | None:
        """What to add to session times; a replay hands on what its log says, if anything."""
        if not isinstance(self.driver, ReplayDriver):
            return self.clock.unix_s() - now_s
        log = self.driver.log
        return None if log.unix_offset_s is None else log.unix_offset_s + log.start_s

    def _spare_the_log(self, spec: SinkSpec) -> None:
        if isinstance(self.driver, ReplayDriver) and spec.rest != "-":
            if Path(spec.rest).resolve() == self.driver.path.resolve():
                raise OutputError(f"{spec} is the log being replayed; choose another file.")

    def run(self, stop: Callable[[], bool]) -> None:
        """Go on until the end of the log, of the duration, or until ``stop``.

        Raises:
            TPoseNotFound: a log ended without a T-pose, and there is no profile.
        """
        self.ticks.stop = stop
        with StatusLine(self.snapshot, self.options.quiet), _undisturbed():
            run(
                self.source,
                self.feed,
                self.session,
                self.outputs,
                self.ticks,
                self._observe,
                self.controls,
            )
        log_ended = isinstance(self.driver, ReplayDriver) and self.driver.finished(
            self.tally.last_s + 1.0 / self.options.rate_hz
        )
        if log_ended and not self.session.calibrated:
            raise self.watcher.failure()

    def _observe(self, tick: Tick, pose: SkeletonPose) -> None:
        self.tally.add(pose, self.session.body if self.session.calibrated else None)
        self._pose = pose
        if self.tally.frames % COLLECT_EVERY == 0:
            gc.collect()

    def snapshot(self) -> Snapshot | None:
        """What the status line shows; None before the first tick."""
        pose = self._pose
        if pose is None:
            return None
        return Snapshot(
            elapsed_s=pose.time_s,
            total_s=self._end_s(),
            frames=self.tally.frames,
            wall_s=self.clock.now_s(),
            calibrated=self.session.calibrated,
            overruns=self.ticks.overruns,
            backlog=sum(queue.backlog for queue in self._queues),
            gate_events=self.feed.gate.events.total(),
            pose=pose,
        )

    def summary(self) -> Summary:
        """What the session was like so far."""
        card = self.session.predictor.card
        between = 0.0 if self.ticks.grid.every_tick else (1.0 - AHEAD) / card.rate_hz
        delay_s = self.options.input_delay_s + between + card.delay_frames / card.rate_hz
        return self.tally.summary(
            self.ticks,
            card.name,
            round(1e3 * delay_s, 3),
            self.session.nonfinite_frames,
            self.feed.gate.events,
        )


@contextmanager
def _undisturbed() -> Iterator[None]:
    """No garbage collection of its own accord while the loop runs: a full one takes 1 to 100 ms."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()
