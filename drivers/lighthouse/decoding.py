"""One device's raw events -> calibrated IMU samples, angles, and what its stations say.

counts  -> imu.py -> ImuSamples
pulses  -> gen1.py (rhythm) -> angles, bits --.
words   -> gen2.py (turns)  -> angles, bits --+-> ootx.py -> station_message.py -> calibration
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import Angles, DeviceModel, ImuSamples, StationCalibration
from lobstr_hw.drivers.lighthouse.gen1 import Gen1Decoder
from lobstr_hw.drivers.lighthouse.gen2 import Gen2Decoder
from lobstr_hw.drivers.lighthouse.imu import ImuRanges, calibrate_imu
from lobstr_hw.drivers.lighthouse.ootx import GEN1_PAYLOAD, GEN2_PAYLOAD, OotxReader, StationBits
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.station_message import parse_station

__all__ = ["Decoded", "DeviceDecoder"]

PORTS = 256


@dataclass(frozen=True, slots=True, eq=False)
class Decoded:
    """What a batch of raw events means.

    Attributes:
        imu: its samples.
        angles: its hits of sensors that the device's model has.
        stations: calibrations that were read (again) in this batch, by ``Angles.station``.
    """

    imu: ImuSamples
    angles: Angles
    stations: dict[int, StationCalibration]


class DeviceDecoder:
    """Decodes one device; how its events are cut into batches is no matter."""

    def __init__(self, model: DeviceModel, ranges: ImuRanges | None = None) -> None:
        """Nothing was seen; ``ranges`` None: the usual ones of such a device."""
        self._model = model
        self._ranges = ranges or ImuRanges.of(model)
        self._rows = np.full(PORTS, -1, dtype=np.int64)
        self._rows[model.ports] = np.arange(len(model.ports))
        self._gen1, self._gen2 = Gen1Decoder(), Gen2Decoder()
        self._ootx: dict[int, OotxReader] = {}

    def decode(self, events: RawEvents) -> Decoded:
        """The next batch."""
        stations: dict[int, StationCalibration] = {}
        angles = [self._decode_gen1(events, stations), self._decode_gen2(events, stations)]
        return Decoded(
            imu=calibrate_imu(events.imu[:, 0], events.imu[:, 1:], self._model, self._ranges),
            angles=self._named(Angles.join(angles)),
            stations=stations,
        )

    def _decode_gen1(self, events: RawEvents, read: dict[int, StationCalibration]) -> Angles:
        angles, told = self._gen1.decode(events.pulses)
        self._read(told, GEN1_PAYLOAD, read)
        return angles

    def _decode_gen2(self, events: RawEvents, read: dict[int, StationCalibration]) -> Angles:
        angles, told = self._gen2.decode(events)
        self._read(told, GEN2_PAYLOAD, read)
        return angles

    def _read(
        self, told: list[StationBits], length: int, read: dict[int, StationCalibration]
    ) -> None:
        for bits in told:
            if bits.fresh or bits.station not in self._ootx:
                self._ootx[bits.station] = OotxReader(length)
            payload = self._ootx[bits.station].feed(bits.bits)
            calibration = parse_station(payload) if payload else None
            if calibration is not None:
                read[bits.station] = calibration

    def _named(self, angles: Angles) -> Angles:
        """Rows of the model for hardware ports; hits of ports that it does not have are dropped."""
        rows = self._rows[angles.sensor]
        known = rows >= 0
        return Angles(
            angles.ticks[known],
            angles.station[known],
            angles.axis[known],
            rows[known],
            angles.angle_rad[known],
        )
