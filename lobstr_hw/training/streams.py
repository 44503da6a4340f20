"""Streams of episodes side by side, given out chunk by chunk.

What stream s plays as its e-th episode depends on (seed, s, e) only: to go on after a stop, the
episode's number and the chunk's are all that has to be kept.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.dataset import Float32
from lobstr_hw.training.episodes import Episode, EpisodeSource

__all__ = ["Chunk", "Position", "Streams"]


@dataclass(frozen=True, slots=True, eq=False)
class Position:
    """Where each stream is: (streams,) numbers of the episode and of the next chunk in it."""

    episode: npt.NDArray[np.int64]
    chunk: npt.NDArray[np.int64]

    @staticmethod
    def start(streams: int) -> "Position":
        """Before anything."""
        return Position(np.zeros(streams, dtype=np.int64), np.zeros(streams, dtype=np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """A piece of every stream, see :class:`lobstr_hw.training.episodes.Episode`.

    Attributes:
        x: (streams, frames, 37).
        pose: (streams, frames, 48).
        contact: (streams, frames, 2).
        yaw: (streams, frames).
        first: (streams,) whether an episode begins: the state is zero.
    """

    x: Float32
    pose: Float32
    contact: npt.NDArray[np.int64]
    yaw: Float32
    first: npt.NDArray[np.bool_]


class Streams:
    """Plays the streams from a position on."""

    def __init__(self, source: EpisodeSource, config: TrainingConfig, position: Position) -> None:
        """Draw the episodes that are being played."""
        self._source, self._config = source, config
        self._number, self._chunk = position.episode.copy(), position.chunk.copy()
        self._episodes = [self._draw(stream) for stream in range(len(self._number))]

    @property
    def position(self) -> Position:
        """Where the next chunk begins."""
        return Position(self._number.copy(), self._chunk.copy())

    def next_chunk(self) -> Chunk:
        """The next chunk of every stream; an episode that is over is followed by a new one."""
        window = self._config.window
        pieces = []
        for stream in range(len(self._episodes)):
            if self._chunk[stream] * window >= len(self._episodes[stream]):
                self._number[stream] += 1
                self._chunk[stream] = 0
                self._episodes[stream] = self._draw(stream)
            at = slice(self._chunk[stream] * window, (self._chunk[stream] + 1) * window)
            episode = self._episodes[stream]
            pieces.append((episode.x[at], episode.pose[at], episode.contact[at], episode.yaw[at]))
        first = self._chunk == 0
        self._chunk += 1
        x, pose, contact, yaw = (np.stack(column) for column in zip(*pieces, strict=True))
        return Chunk(x, pose, contact, yaw, first)

    def _draw(self, stream: int) -> Episode:
        seed = [self._config.seed, stream, int(self._number[stream])]
        return self._source.draw(np.random.default_rng(seed))
