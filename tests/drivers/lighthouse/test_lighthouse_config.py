"""What devices keep about themselves: download, JSON, frames, IMU calibration."""

import json
import math
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.device_config import (
    LONGEST_JSON,
    inflate_config,
    join_pieces,
    parse_config,
)
from lobstr_hw.drivers.lighthouse.imu import ImuRanges, calibrate_imu
from lobstr_hw.errors import FileFormatError
from lobstr_hw.rotations import Array

POINTS = [[0.01, 0.02, 0.03], [-0.01, 0.0, 0.05], [0.0, -0.03, 0.01]]
NORMALS = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def old_config(**changes: Any) -> dict[str, Any]:
    """As wands and Trackers 1.0 have it."""
    half = math.sqrt(0.5)
    return {
        "device_serial_number": "LHR-01234567",
        "device_class": "generic_tracker",
        "model_name": "Vive Tracker MV",
        "device_pid": 0x2022,
        "acc_bias": [0.1, -0.2, 0.3],
        "acc_scale": [1.0, 0.99, 1.01],
        "gyro_bias": [0.01, 0.0, -0.01],
        "gyro_scale": [1, 1, 1],
        "trackref_from_imu": [0, 0, half, half, 0.01, 0.02, 0.03],
        "trackref_from_head": [1, 0, 0, 0, 0, 0.04, 0.05],
        "lighthouse_config": {
            "modelPoints": POINTS,
            "modelNormals": NORMALS,
            "channelMap": [2, 0, 7],
        },
    } | changes


def new_config() -> dict[str, Any]:
    """The same device as newer ones have it."""
    old = old_config()
    imu = {k: old.pop(k) for k in ("acc_bias", "acc_scale", "gyro_bias", "gyro_scale")}
    del old["trackref_from_imu"], old["trackref_from_head"]
    # a quarter turn about z takes x to y; a half turn about x keeps x and turns z round
    imu |= {"plus_x": [0, 1, 0], "plus_z": [0, 0, 1], "position": [0.01, 0.02, 0.03]}
    head = {"plus_x": [1, 0, 0], "plus_z": [0, 0, -1], "position": [0, 0.04, 0.05]}
    return old | {"imu": imu, "head": head}


def parse(config: object) -> DeviceModel:
    return parse_config(json.dumps(config))


def test_both_shapes_of_json_mean_the_same_device() -> None:
    old, new = parse(old_config()), parse(new_config())
    for name in ("points", "normals", "ports", "acc_bias_g", "acc_scale", "gyro_bias_rad_s"):
        np.testing.assert_allclose(getattr(old, name), getattr(new, name), atol=1e-12)
    for name in ("T_imu_trackref", "T_imu_head"):
        np.testing.assert_allclose(getattr(old, name).R, getattr(new, name).R, atol=1e-12)
        np.testing.assert_allclose(getattr(old, name).p, getattr(new, name).p, atol=1e-12)
    assert (old.serial, old.model, old.product_id) == ("LHR-01234567", "Vive Tracker MV", 0x2022)


def test_sensors_lie_in_the_imu_frame() -> None:
    model = parse(old_config())
    # the IMU's x axis is trackref's y: (x, y, z) of trackref is (y, -x, z) of the IMU
    x, y, z = np.array(POINTS[0]) - [0.01, 0.02, 0.03]
    np.testing.assert_allclose(model.points[0], [y, -x, z], atol=1e-12)
    np.testing.assert_allclose(model.normals[0], [0, -1, 0], atol=1e-12)
    assert model.ports.tolist() == [2, 0, 7]


def test_without_a_map_ports_are_the_sensors_own_numbers() -> None:
    light = {"modelPoints": POINTS, "modelNormals": NORMALS}
    assert parse(old_config(lighthouse_config=light)).ports.tolist() == [0, 1, 2]


def test_a_download_is_put_together_whatever_stands_before_it() -> None:
    packed = zlib.compress(json.dumps(old_config()).encode())
    pieces = [packed[k : k + 62] for k in range(0, len(packed), 62)]
    reports = [bytes([0x11, len(p)]) + p.ljust(62, b"\xee") for p in [b"8 unused", *pieces, b""]]
    assert json.loads(inflate_config(join_pieces(reports))) == old_config()
    assert json.loads(inflate_config(join_pieces(reports[1:]))) == old_config()


def test_half_a_download_and_one_without_end_are_refused() -> None:
    packed = zlib.compress(json.dumps(old_config()).encode())
    with pytest.raises(FileFormatError, match="is cut short"):
        inflate_config(packed[:-20])
    with pytest.raises(FileFormatError, match=f"over {LONGEST_JSON} bytes"):
        inflate_config(zlib.compress(bytes(50 * LONGEST_JSON)))
    with pytest.raises(FileFormatError, match="damaged"):
        inflate_config(b"\x78\x9c" + b"\xff" * 50)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"lighthouse_config": {"modelPoints": [], "modelNormals": []}}, "rows of 3"),
        ({"lighthouse_config": {"modelPoints": POINTS, "modelNormals": NORMALS[:2]}}, "2 modelN"),
        ({"trackref_from_imu": [0, 0, 0, 0, 0, 0, 0]}, "length 1"),
        ({"acc_bias": [1e308, 0, 0]}, "expected 3 numbers"),
        ({"acc_bias": "none"}, "could not convert"),
        ({"device_serial_number": {}}, "should be a text"),
        ({"device_pid": None}, "TypeError"),
    ],
)
def test_a_config_that_makes_no_sense_says_what_is_wrong(change: dict[str, Any], what: str) -> None:
    with pytest.raises(FileFormatError, match=what):
        parse(old_config(**change))


JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=8), st.dictionaries(st.text(max_size=5), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(st.sampled_from([*old_config(), "imu", "head"]), JSON)
def test_anything_in_place_of_a_value_is_a_device_or_a_documented_error(
    key: str, value: Any
) -> None:
    try:
        model = parse(old_config(**{key: value}))
    except FileFormatError:
        return
    assert np.isfinite(model.points).all()
    assert len(model.points) == len(model.normals) == len(model.ports)


@given(st.one_of(JSON.map(json.dumps), st.text()))
def test_any_text_is_a_device_or_a_documented_error(text: str) -> None:
    with pytest.raises(FileFormatError):
        parse_config(text)


def test_a_deep_nest_and_endless_digits_are_documented_errors() -> None:
    for text in ("[" * 100_000, "1" * 100_000, b"\xff\xfe"):
        with pytest.raises(FileFormatError):
            parse_config(text)


@given(st.binary(max_size=300))
def test_any_bytes_of_a_download_are_a_documented_error(data: bytes) -> None:
    with pytest.raises(FileFormatError):
        inflate_config(data)


def test_at_rest_a_calibrated_imu_says_one_g_upwards() -> None:
    model = parse(old_config())
    up = np.array([0.0, 0.6, 0.8])
    acc = (up + model.acc_bias_g) / model.acc_scale * 32768 / 8
    gyro = model.gyro_bias_rad_s * 32768 / math.radians(2000)
    counts = np.round(np.concatenate([acc, gyro])).astype(np.int64)[None]
    samples = calibrate_imu(np.array([5]), counts, model, ImuRanges.of(model))
    np.testing.assert_allclose(samples.acc_g[0], up, atol=2e-4)
    np.testing.assert_allclose(samples.gyro_rad_s[0], 0, atol=6e-4)


def test_headsets_have_finer_ranges() -> None:
    assert ImuRanges.of(parse(old_config(device_class="hmd"))) == ImuRanges(500.0, 4.0)
    assert ImuRanges.of(parse(old_config())) == ImuRanges(2000.0, 8.0)
    counts: Array = np.full((1, 6), 16384)
    model = parse(old_config(acc_bias=[0, 0, 0], acc_scale=[1, 1, 1], gyro_bias=[0, 0, 0]))
    samples = calibrate_imu(np.array([0]), counts.astype(np.int64), model, ImuRanges(500.0, 4.0))
    np.testing.assert_allclose(samples.acc_g, 2.0)
    np.testing.assert_allclose(samples.gyro_rad_s, math.radians(250))
