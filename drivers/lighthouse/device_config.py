"""What a device is: the JSON that it keeps about itself, brought into its IMU frame.

    feature report 10, asked once      feature report 11, asked until n is 0
    0  u8  10                          0  u8 11
    1  u16 compressed length, big      1  u8 n, 62 at most
           endian, may be 2 short      2  n bytes

All n bytes in a row are one zlib stream; a first piece that does not begin with 78 is not of it.

Two shapes of JSON occur. Old: ``acc_bias`` and the like at the top, ``trackref_from_imu`` and
``trackref_from_head`` as [qx, qy, qz, qw, px, py, pz]. New: an object ``imu`` with the same and
``plus_x``, ``plus_z``, ``position``, and an object ``head``: two axes and the origin, in trackref.
"""

import json
import zlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.errors import FileFormatError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array

__all__ = [
    "CONFIG_PIECE",
    "CONFIG_START",
    "MOST_PIECES",
    "inflate_config",
    "join_pieces",
    "parse_config",
]

CONFIG_START, CONFIG_PIECE = 0x10, 0x11
MOST_PIECES = 1_024
"""Of a configuration; real ones have 60."""
ZLIB_START = 0x78
LONGEST_JSON = 1 << 20
"""Bytes; real ones have 4 to 17 thousand."""
MOST_SENSORS = 64
LARGEST_M = 2.0
"""No sensor is further from its device's origin."""
LARGEST = 1_000.0
"""No bias, scale or length is as large."""
STANDARD_GRAVITY = 9.80665
Json = dict[str, Any]


def join_pieces(reports: Iterable[bytes]) -> bytes:
    """The compressed JSON, from feature reports 11 in their order."""
    pieces = [
        data[2 : 2 + data[1]] for data in reports if len(data) > 2 and data[0] == CONFIG_PIECE
    ]
    pieces = [piece for piece in pieces if piece]
    if pieces and pieces[0][0] != ZLIB_START:
        pieces = pieces[1:]
    return b"".join(pieces)


def inflate_config(compressed: bytes) -> bytes:
    """The JSON of a download.

    Raises:
        FileFormatError: it is cut short, damaged, or would not end.
    """
    unpacking = zlib.decompressobj()
    try:
        data = unpacking.decompress(compressed, LONGEST_JSON)
    except zlib.error as error:
        raise FileFormatError(f"the device's configuration is damaged: {error}") from error
    if not unpacking.eof:
        what = "is cut short" if len(data) < LONGEST_JSON else f"is over {LONGEST_JSON} bytes"
        raise FileFormatError(f"the device's configuration {what}")
    return data


def parse_config(text: bytes | str) -> DeviceModel:
    """A device from its JSON.

    Raises:
        FileFormatError: it is no JSON of a device with light sensors; says what is wrong.
    """
    try:
        config = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"the device's configuration is no JSON: {error}") from error
    try:
        return _device(config)
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        raise FileFormatError(
            f"the device's configuration makes no sense: {type(error).__name__}: {error}"
        ) from error


def _device(config: Json) -> DeviceModel:
    imu = config.get("imu", config)
    T_trackref_imu = _frame(config, "imu", "trackref_from_imu")
    T_trackref_head = _frame(config, "head", "trackref_from_head")
    T_imu_trackref = T_trackref_imu.inverse()
    light = config["lighthouse_config"]
    points, normals = _rows(light["modelPoints"]), _rows(light["modelNormals"])
    if len(points) != len(normals):
        raise ValueError(f"{len(points)} modelPoints and {len(normals)} modelNormals")
    return DeviceModel(
        serial=_text(config["device_serial_number"]),
        device_class=_text(config.get("device_class", "")),
        model=_text(config.get("model_number", config.get("model_name", ""))),
        points=T_imu_trackref.apply(points),
        normals=(T_imu_trackref.R @ normals[..., None])[..., 0],
        ports=_ports(light.get("channelMap"), len(points)),
        T_imu_trackref=T_imu_trackref,
        T_imu_head=T_imu_trackref @ T_trackref_head,
        acc_bias_g=_numbers(imu.get("acc_bias", [0, 0, 0]), 3) / STANDARD_GRAVITY,
        acc_scale=_numbers(imu.get("acc_scale", [1, 1, 1]), 3),
        gyro_bias_rad_s=_numbers(imu.get("gyro_bias", [0, 0, 0]), 3),
        gyro_scale=_numbers(imu.get("gyro_scale", [1, 1, 1]), 3),
        product_id=int(config.get("device_pid", 0)),
    )


def _frame(config: Json, new: str, old: str) -> Pose:
    """Takes a frame of the device into trackref; trackref itself where nothing is said."""
    if "plus_x" in config.get(new, {}):
        axes = config[new]
        return _from_axes(_unit(axes["plus_x"], 3), _unit(axes["plus_z"], 3), axes["position"])
    if old in config:
        return _from_quaternion(_numbers(config[old], 7))
    return Pose.identity()


def _from_axes(x: Array, z: Array, position: object) -> Pose:
    y = np.cross(z, x)
    if np.linalg.norm(y) < 0.99:
        raise ValueError(f"plus_x {x} and plus_z {z} are not at a right angle")
    y /= np.linalg.norm(y)
    return Pose(np.stack([x, y, np.cross(x, y)], axis=1), _numbers(position, 3))


def _from_quaternion(values: Array) -> Pose:
    x, y, z, w = _unit(values[:4], 4)
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return Pose(R, values[4:])


def _rows(values: object) -> Array:
    """(s, 3) numbers of believable size."""
    rows = np.array(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3 or not 1 <= len(rows) <= MOST_SENSORS:
        raise ValueError(f"expected up to {MOST_SENSORS} rows of 3 numbers, got {rows.shape}")
    if not (np.abs(rows) < LARGEST_M).all():
        raise ValueError("a sensor is not where a device can have one")
    return rows


def _ports(values: object, sensors: int) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Hardware port of each sensor; their own numbers where nothing is said."""
    if values is None:
        return np.arange(sensors)
    ports = np.array(values, dtype=np.float64)
    if ports.shape != (sensors,) or not ((ports >= 0) & (ports < 256)).all():
        raise ValueError(f"channelMap {values} does not name a port for each of {sensors} sensors")
    return ports.astype(np.int64)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r} should be a text")
    return value


def _numbers(values: object, count: int) -> Array:
    numbers = np.array(values, dtype=np.float64)
    if numbers.shape != (count,) or not (np.abs(numbers) < LARGEST).all():
        raise ValueError(f"expected {count} numbers, got {values}")
    return numbers


def _unit(values: object, count: int) -> Array:
    numbers = _numbers(values, count)
    length = np.linalg.norm(numbers)
    if not 0.5 < length < 2.0:
        raise ValueError(f"{values} should have the length 1")
    return numbers / length
