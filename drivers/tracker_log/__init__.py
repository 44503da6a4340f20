"""The tracker log: MCAP files of samples, states and truth."""

from lobstr_hw.drivers.tracker_log.reader import read_log
from lobstr_hw.drivers.tracker_log.repair import Repaired, repair_log
from lobstr_hw.drivers.tracker_log.tracks import (
    SkeletonTrack,
    TrackerLog,
    TrackerTrack,
    TruthTrack,
)
from lobstr_hw.drivers.tracker_log.writer import TrackerLogWriter

__all__ = [
    "Repaired",
    "SkeletonTrack",
    "TrackerLog",
    "TrackerLogWriter",
    "TrackerTrack",
    "TruthTrack",
    "read_log",
    "repair_log",
]
