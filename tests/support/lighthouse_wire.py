"""What a device by cable says over USB in a made-up room with Gen2 stations: bytes of reports.

IMU counts and ticks are rounded as a device rounds them; the rest is exact.
"""

import json
import math
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from support.lighthouse_room import Motion, imu_of, light_of, turn_starts

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    DeviceModel,
    ImuSamples,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.gen2 import PERIODS
from lobstr_hw.drivers.lighthouse.light import Station

__all__ = ["TimedReport", "config_of", "frame_bits", "reports_of", "station_payload"]

FIRST_TICK = 1_000_000
IMU, LIGHT = 0, 1
"""Interfaces."""
WORDS = 62
"""Bytes of words that fit into a report."""
FLUSH_TICKS = TICKS_PER_S // 250
GYRO_DEG_S, ACC_G = 2000.0, 8.0


@dataclass(frozen=True, slots=True)
class TimedReport:
    """One report, and the device's time at which it leaves the device."""

    ticks: int
    interface: int
    data: bytes


def config_of(model: DeviceModel) -> bytes:
    """The compressed JSON of a device whose frames are all that of its IMU."""
    said = {
        "device_serial_number": model.serial,
        "device_class": model.device_class,
        "model_number": model.model,
        "device_pid": model.product_id,
        "acc_scale": [1, 1, 1],
        "acc_bias": [0, 0, 0],
        "gyro_scale": [1, 1, 1],
        "gyro_bias": [0, 0, 0],
        "lighthouse_config": {
            "modelPoints": model.points.tolist(),
            "modelNormals": model.normals.tolist(),
            "channelMap": model.ports.tolist(),
        },
    }
    return zlib.compress(json.dumps(said).encode())


def station_payload(c: StationCalibration, channel: int) -> bytes:
    """What a Gen2 station says about itself."""
    up = np.rint(127 * c.up).astype(int).tolist()
    two = (c.phase, c.tilt)
    head = struct.pack("<HI4eBB", 6, c.id, *np.concatenate(two), c.unlock_count, 0)
    middle = struct.pack("<2e3b4e", *c.curve, *up, *c.gibphase, *c.gibmag)
    tail = struct.pack("<BB4eH", channel, 0, *c.ogeephase, *c.ogeemag, 7)
    return head + middle + tail


def frame_bits(payload: bytes) -> list[int]:
    """An OOTX frame as a station sends it."""
    data = struct.pack("<H", len(payload)) + payload + b"\0" * (len(payload) % 2)
    data += struct.pack("<I", zlib.crc32(payload))
    digits = "".join(f"{byte:08b}" for byte in data)
    words = [digits[k : k + 16] + "1" for k in range(0, len(digits), 16)]
    return [int(bit) for bit in "0" * 17 + "1" + "".join(words)]


def reports_of(
    stations: Mapping[int, Station],
    model: DeviceModel,
    motion: Motion,
    seconds: float,
    noise: float = 1.0,
    rate_hz: float = 250.0,
    seed: int = 0,
    dark_s: tuple[float, float] = (0.0, 0.0),
) -> list[TimedReport]:
    """All reports of a device, in the order in which they leave it.

    Args:
        stations: Gen2, by channel.
        model: the device.
        motion: what it does.
        seconds: for how long.
        noise: of the IMU, 1 = that of a real one; the light's goes with it, 0.1 mrad.
        rate_hz: of the IMU.
        seed: of the noise.
        dark_s: from when to when nothing is seen of the stations.
    """
    imu = imu_of(motion, seconds, rate_hz, noise, 0.01 * noise, seed, FIRST_TICK)
    light = _light_reports(dict(stations), model, motion, seconds, noise, seed, dark_s)
    reports = [*_imu_reports(imu), *light]
    return sorted(reports, key=lambda report: report.ticks)


def _imu_reports(imu: ImuSamples) -> Iterator[TimedReport]:
    """Each has the newest sample and the two before it."""
    full = 32768
    acc = np.rint(imu.acc_g / ACC_G * full)
    gyro = np.rint(np.degrees(imu.gyro_rad_s) / GYRO_DEG_S * full)
    counts = np.clip(np.concatenate([acc, gyro], axis=1), -full, full - 1).astype(int)
    slots = [
        struct.pack("<6hIB", *row, tick & 0xFFFFFFFF, k & 0xFF)
        for k, (row, tick) in enumerate(zip(counts.tolist(), imu.ticks.tolist(), strict=True))
    ]
    for k in range(len(slots)):
        newest = [slots[max(j, 0)] for j in (k - 2, k - 1, k)]
        # the places go round
        round_robin = b"".join(newest[(j - k - 1) % 3] for j in range(3))
        yield TimedReport(int(imu.ticks[k]), IMU, b"\x20" + round_robin)


def _light_reports(
    stations: dict[int, Station],
    model: DeviceModel,
    motion: Motion,
    seconds: float,
    noise: float,
    seed: int,
    dark_s: tuple[float, float],
) -> Iterator[TimedReport]:
    """Words as soon as a report is full of them, or after 4 ms."""
    packed, since = b"", 0
    for tick, word in _words(stations, model, motion, seconds, noise, seed, dark_s):
        if packed and (len(packed) + len(word) > WORDS or tick - since > FLUSH_TICKS):
            yield TimedReport(tick, LIGHT, _light_report(packed))
            packed = b""
        since = since if packed else tick
        packed += word
    yield TimedReport(since + FLUSH_TICKS, LIGHT, _light_report(packed))


def _light_report(words: bytes) -> bytes:
    return bytes([0x28, len(words)]) + words.ljust(WORDS, b"\0")


def _words(
    stations: dict[int, Station],
    model: DeviceModel,
    motion: Motion,
    seconds: float,
    noise: float,
    seed: int,
    dark_s: tuple[float, float],
) -> list[tuple[int, bytes]]:
    """Every sync and sweep with its channel marker, by time."""
    words: list[tuple[int, bytes]] = []
    for number, station in stations.items():
        bits = frame_bits(station_payload(station.calibration, number))
        for k, start in enumerate(turn_starts(2, number, PERIODS[number], seconds).tolist()):
            tick = FIRST_TICK + start
            words.append((tick, _word(number, (tick & 0xFFFFFF) << 2 | bits[k % len(bits)] << 26)))
    light = light_of(
        stations, model, motion, seconds, 0.0, seed, FIRST_TICK, turns=PERIODS
    )  # fmt: skip
    random = np.random.default_rng(seed)
    turn = np.array(PERIODS)[light.station]
    off = np.rint(random.normal(scale=1e-4 * noise, size=len(light)) * turn / (2 * math.pi))
    for tick, number, row in zip(
        (light.ticks + off.astype(int)).tolist(), light.station.tolist(), light.sensor.tolist(),
        strict=True,
    ):  # fmt: skip
        port = int(model.ports[row])
        words.append((tick, _word(number, port << 27 | (tick & 0xFFFFFF) << 3 | 0b010)))
    a, b = (FIRST_TICK + int(t * TICKS_PER_S) for t in dark_s)
    return sorted(word for word in words if not a < word[0] < b)


def _word(channel: int, word: int) -> bytes:
    return bytes([channel << 4 | 1]) + struct.pack("<I", word)
