"""Every error that this project raises on purpose, in one tree.

LobstrError
├── DriverError
│   ├── TrackerNotFound      no device answers, or no tracker is bound to a role
│   ├── DeviceBusy           another program holds the device
│   └── DriverUnavailable    a library, runtime or permission is missing
├── CalibrationError
│   ├── TPoseNotFound        nobody stood still in a T-pose
│   ├── MissingRole          a role that is needed has no tracker
│   ├── StationsNotSolved    what was seen does not tell where the base stations stand
│   ├── SpacesNotJoined      how two tracking spaces lie to each other cannot be told
│   └── ProfileError         a calibration profile cannot be used
├── FileFormatError
│   ├── MotionFileError      a motion clip (BVH) cannot be read
│   ├── UnknownRig           no table names the joints of this clip
│   ├── LogFileError         a tracker log cannot be read
│   └── StationFileError     a file of base stations cannot be used
├── ModelError               weights and code disagree
└── OutputError              an output cannot be opened

A message says what was seen and what to do next.
"""

__all__ = [
    "CalibrationError",
    "DeviceBusy",
    "DriverError",
    "DriverUnavailable",
    "FileFormatError",
    "LobstrError",
    "LogFileError",
    "MissingRole",
    "ModelError",
    "MotionFileError",
    "OutputError",
    "ProfileError",
    "SpacesNotJoined",
    "StationFileError",
    "StationsNotSolved",
    "TPoseNotFound",
    "TrackerNotFound",
    "UnknownRig",
]


class LobstrError(Exception):
    """Base of all errors of this project; its text is meant for the user."""


class DriverError(LobstrError):
    """A device driver could not be opened."""


class TrackerNotFound(DriverError):
    """No device answers, or no tracker is bound to a role."""


class DeviceBusy(DriverError):
    """Another program holds the device."""


class DriverUnavailable(DriverError):
    """A library, runtime or permission is missing."""


class CalibrationError(LobstrError):
    """Calibrating is not possible with what was seen."""


class TPoseNotFound(CalibrationError):
    """Nobody stood still in a T-pose."""


class MissingRole(CalibrationError):
    """A role that is needed has no tracker."""


class ProfileError(CalibrationError):
    """A calibration profile cannot be used."""


class SpacesNotJoined(CalibrationError):
    """How two tracking spaces lie to each other cannot be told."""


class StationsNotSolved(CalibrationError):
    """What was seen does not tell where the base stations stand."""


class FileFormatError(LobstrError):
    """A file is not what it should be."""


class MotionFileError(FileFormatError):
    """A motion clip cannot be read."""


class UnknownRig(FileFormatError):
    """No table names the joints of this clip."""


class LogFileError(FileFormatError):
    """A tracker log cannot be read."""


class StationFileError(FileFormatError):
    """A file of base stations cannot be used."""


class ModelError(LobstrError):
    """Weights and code disagree."""


class OutputError(LobstrError):
    """An output cannot be opened."""
