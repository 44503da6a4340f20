"""The profile: a calibration as JSON that a person can read."""

import json
import math
import os
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from lobstr_hw.calibration.calibration import Calibration, Residuals, TrackingSpace
from lobstr_hw.errors import ProfileError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_quat_xyzw, to_quat_xyzw
from lobstr_hw.skeleton import HUMANOID_NAMES, Body
from lobstr_hw.trackers import TrackerRole

__all__ = ["FORMAT", "load_profile", "profile_from_json", "profile_to_json", "save_profile"]

FORMAT = 1
_REMEDY = "Make a new one: lobstr-calibrate --profile FILE"
_RETRIES = 20  # on Windows a virus scanner may hold the old file for a moment
_RETRY_S = 0.05


def profile_to_json(calibration: Calibration) -> str:
    """The profile as text."""
    trackers = {
        serial: {
            "role": str(role),
            "joint_in_tracker_m": calibration.p_tracker_joint[i].tolist(),
            "joint_in_tracker_quat_xyzw": to_quat_xyzw(calibration.R_tracker_joint[i]).tolist(),
        }
        for i, (serial, role) in enumerate(calibration.roles.items())
    }
    body = calibration.body
    spaces = {name: _space(space) for name, space in calibration.tracking_spaces.items()}
    document = {
        "format": FORMAT,
        "created": calibration.created,
        "stature_m": calibration.stature_m,
        "hips_height_m": float(1.0 / body.scale[0]),
        "floor_height_m": calibration.floor_m,
        "heading_rad": calibration.heading_rad,
        "trackers": trackers,
        "body": {
            "sole_m": float(body.sole[0]),
            "offsets_m": dict(zip(HUMANOID_NAMES, body.offsets[0].tolist(), strict=True)),
        },
        "tracking_spaces": spaces,
        "residuals": asdict(calibration.residuals),
    }
    return json.dumps(document, indent=2) + "\n"


def _space(space: TrackingSpace) -> dict[str, Any]:
    return {
        "position_m": space.T_world_space.p.tolist(),
        "quat_xyzw": to_quat_xyzw(space.T_world_space.R).tolist(),
        "delay_s": space.delay_s,
        "residual_m": space.residual_m,
        "residual_rad": space.residual_rad,
    }


def save_profile(path: Path | str, calibration: Calibration) -> None:
    """Write a profile as a whole or not at all.

    Raises:
        ProfileError: the place cannot be written to.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".new")
    except OSError as error:
        raise ProfileError(f"{path}: cannot be written ({error.strerror}).") from error
    try:
        with open(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(profile_to_json(calibration))
            file.flush()
            os.fsync(file.fileno())
        _replace(name, path)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise ProfileError(f"{path}: cannot be written ({error.strerror}).") from error


def _replace(name: str, path: Path) -> None:
    for _ in range(_RETRIES):
        try:
            os.replace(name, path)
            return
        except PermissionError:
            time.sleep(_RETRY_S)
    os.replace(name, path)


def load_profile(path: Path | str) -> Calibration:
    """Read and check a profile.

    Raises:
        ProfileError: says which file, which key and what to do.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ProfileError(f"{path}: no such profile. {_remedy(path)}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ProfileError(f"{path}: cannot be read ({error}). {_remedy(path)}") from error
    return profile_from_json(text, str(path))


def profile_from_json(text: str, name: str = "profile") -> Calibration:
    """A profile from its text; ``name`` is what errors call it.

    Raises:
        ProfileError: says which file, which key and what to do.
    """
    try:
        document = json.loads(text)
    except ValueError as error:
        raise ProfileError(f"{name}: is not JSON ({error}). {_remedy(name)}") from error
    reader = _Reader(name, document)
    version = reader.value("format")
    if version != FORMAT:
        raise reader.fault("format", f"is {version!r}; this program reads {FORMAT}")
    trackers = reader.mapping("trackers")
    if not trackers:
        raise reader.fault("trackers", "has no tracker")
    keys = [("trackers", serial) for serial in trackers]
    roles = {key[-1]: reader.role(*key, "role") for key in keys}
    if len(set(roles.values())) < len(roles):
        raise reader.fault("trackers", "name one role twice")
    hips_height_m = reader.positive("hips_height_m")
    body = Body(
        np.array([[reader.numbers("body", "offsets_m", joint, n=3) for joint in HUMANOID_NAMES]]),
        np.array([reader.positive("body", "sole_m")]),
        np.array([1.0 / hips_height_m]),
    )
    return Calibration(
        roles=roles,
        R_tracker_joint=np.stack(
            [reader.rotation(*key, "joint_in_tracker_quat_xyzw") for key in keys]
        ),
        p_tracker_joint=np.stack([reader.numbers(*key, "joint_in_tracker_m", n=3) for key in keys]),
        body=body,
        stature_m=reader.positive("stature_m"),
        floor_m=reader.number("floor_height_m"),
        heading_rad=reader.number("heading_rad"),
        residuals=Residuals(
            **{field: reader.number("residuals", field) for field in Residuals.__slots__}
        ),
        tracking_spaces={
            name: _read_space(reader, "tracking_spaces", name)
            for name in reader.mapping("tracking_spaces")
        },
        created=str(reader.value("created")),
    )


def _read_space(reader: "_Reader", *keys: str) -> TrackingSpace:
    return TrackingSpace(
        Pose(reader.rotation(*keys, "quat_xyzw"), reader.numbers(*keys, "position_m", n=3)),
        reader.number(*keys, "delay_s"),
        reader.number(*keys, "residual_m"),
        reader.number(*keys, "residual_rad"),
    )


def _remedy(name: Path | str) -> str:
    return _REMEDY.replace("FILE", str(name))


class _Reader:
    """Values of a document by their keys; what is wrong is told with the whole way to the key."""

    def __init__(self, name: str, document: Any) -> None:
        self.name = name
        self.document = document

    def fault(self, key: str, what: str) -> ProfileError:
        return ProfileError(f"{self.name}: {key} {what}. {_remedy(self.name)}")

    def value(self, *keys: str) -> Any:
        at = self.document
        for i, key in enumerate(keys):
            if not isinstance(at, dict) or key not in at:
                raise self.fault(".".join(keys[: i + 1]), "is missing")
            at = at[key]
        return at

    def mapping(self, *keys: str) -> Mapping[str, Any]:
        value = self.value(*keys)
        if not isinstance(value, dict):
            raise self.fault(".".join(keys), f"should be an object, not {value!r}")
        return value

    def number(self, *keys: str) -> float:
        value = self.value(*keys)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
        ):
            raise self.fault(".".join(keys), f"should be a finite number, not {value!r}")
        return float(value)

    def positive(self, *keys: str) -> float:
        value = self.number(*keys)
        if value <= 0.0:
            raise self.fault(".".join(keys), f"should be above 0, not {value!r}")
        return value

    def numbers(self, *keys: str, n: int) -> Array:
        value = self.value(*keys)
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.array(np.nan)
        if array.shape != (n,) or not np.isfinite(array).all():
            raise self.fault(".".join(keys), f"should be {n} finite numbers, not {value!r}")
        return array

    def rotation(self, *keys: str) -> Array:
        quat_xyzw = self.numbers(*keys, n=4)
        if abs(float(np.linalg.norm(quat_xyzw)) - 1.0) > 1e-3:
            raise self.fault(".".join(keys), "is no rotation: its length is not 1")
        return from_quat_xyzw(quat_xyzw)

    def role(self, *keys: str) -> TrackerRole:
        value = self.value(*keys)
        try:
            return TrackerRole(value)
        except ValueError as error:
            choices = ", ".join(TrackerRole)
            raise self.fault(".".join(keys), f"is {value!r}, not one of {choices}") from error
