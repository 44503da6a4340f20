"""What a device measured, before anyone thinks about it: columns of counts and unwrapped ticks."""

from dataclasses import dataclass

from lobstr_hw.drivers.lighthouse.angles import Ints

__all__ = ["RawEvents"]


@dataclass(frozen=True, slots=True, eq=False)
class RawEvents:
    """A batch of one device, each kind in the order of its arrival.

    Attributes:
        imu: (k, 7) ticks, acceleration x, y, z, gyroscope x, y, z.
        pulses: (n, 3) Gen1: port, start, length.
        syncs: (s, 4) Gen2: channel, ticks, data bit, g bit.
        sweeps: (m, 4) Gen2: channel, port, ticks, half a tick later.
        syncs_before: (m,) how many of the batch's syncs came before each sweep.
    """

    imu: Ints
    pulses: Ints
    syncs: Ints
    sweeps: Ints
    syncs_before: Ints

    def __len__(self) -> int:
        """Events of all kinds."""
        return len(self.imu) + len(self.pulses) + len(self.syncs) + len(self.sweeps)
