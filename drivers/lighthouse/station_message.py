"""What a base station says about itself: the payload of an OOTX frame.

Little-endian; e is a half float, two of them are of axis or plane 0 and 1.

    Gen1 (33 bytes) and Gen2 (43) begin alike         then Gen1            then Gen2
    0   u16 bits 15-6 firmware, 5-0 protocol          31 u8 mode A, B, C   31 u8 bits 6-0 channel
    2   u32 id                                        32 u8 faults         32 u8 faults
    6   2e  phase             16  2e    curve                              33 2e ogeephase
    10  2e  tilt              20  3 i8  up: 127 long                       37 2e ogeemag
    14  u8  unlock count      23  2e    gibphase                           41 u16 of this start
    15  u8  hardware          27  2e    gibmag
"""

import struct

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.rotations import Array

__all__ = ["parse_station"]

COMMON = struct.Struct("<HI4eBB2e3b4eBB")
GEN2_TAIL = struct.Struct("<4eH")
PROTOCOL, PROTOCOL_BITS = 6, 0x3F
CHANNEL = 0x7F
LARGEST = 4.0
"""No number of a calibration is as large; phases lie within +-pi."""


def parse_station(payload: bytes) -> StationCalibration | None:
    """The calibration that a station sends, or None: no sense, or of another protocol."""
    if len(payload) not in (COMMON.size, COMMON.size + GEN2_TAIL.size):
        return None
    version, number, *numbers = COMMON.unpack_from(payload)
    p0, p1, t0, t1, unlocks, _, c0, c1, *up = numbers[:11]
    g0, g1, m0, m1, mode, _ = numbers[11:]
    is_gen2 = len(payload) > COMMON.size
    ogee = GEN2_TAIL.unpack_from(payload, COMMON.size)[:4] if is_gen2 else (0.0,) * 4
    values = np.array([[p0, p1], [t0, t1], [c0, c1], [g0, g1], [m0, m1], ogee[:2], ogee[2:]])
    if not (np.abs(values) < LARGEST).all() or (
        not is_gen2 and version & PROTOCOL_BITS != PROTOCOL
    ):
        return None
    if not is_gen2:
        values[1] = np.tan(values[1])
    phase, tilt, curve, gibphase, gibmag, ogeephase, ogeemag = values
    return StationCalibration(
        generation=2 if is_gen2 else 1,
        id=number,
        phase=phase,
        tilt=tilt,
        curve=curve,
        gibphase=gibphase,
        gibmag=gibmag,
        ogeephase=ogeephase,
        ogeemag=ogeemag,
        up=_unit(np.array(up, dtype=np.float64)),
        mode=mode & CHANNEL,
        unlock_count=unlocks,
    )


def _unit(up: Array) -> Array:
    length = np.linalg.norm(up)
    return up / length if length else up
