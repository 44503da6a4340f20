"""What a device measured, before anyone thinks about it: columns of counts and unwrapped ticks."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import Ints

__all__ = ["EventLists", "RawEvents"]

Row = tuple[int, ...]


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


@dataclass(slots=True)
class EventLists:
    """Collects events one by one, as rows of RawEvents."""

    imu: list[Row] = field(default_factory=list)
    pulses: list[Row] = field(default_factory=list)
    syncs: list[Row] = field(default_factory=list)
    sweeps: list[Row] = field(default_factory=list)
    syncs_before: list[int] = field(default_factory=list)

    def add_sweep(self, row: Row) -> None:
        """A sweep, after the syncs that are there."""
        self.sweeps.append(row)
        self.syncs_before.append(len(self.syncs))

    def events(self) -> RawEvents:
        """What was collected."""
        return RawEvents(
            imu=_table(self.imu, 7),
            pulses=_table(self.pulses, 3),
            syncs=_table(self.syncs, 4),
            sweeps=_table(self.sweeps, 4),
            syncs_before=np.array(self.syncs_before, dtype=np.int64),
        )


def _table(rows: Sequence[Row], columns: int) -> Ints:
    return np.array(rows, dtype=np.int64).reshape(-1, columns)
