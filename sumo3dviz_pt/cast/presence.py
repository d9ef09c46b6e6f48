"""Where road users are at a time: stretches of motion, sampled for a block of frames at once.

A sample of one time costs as much as one of thirty. Blocks hold the frames of a shot,
counted from its first one; what a frame shows does not depend on them, because motion is
a pure function of each time by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.trajectory import MotionPiece, Trajectory

BLOCK = 32
"""Frames that are sampled together."""

_COLUMNS = 7


@dataclass(frozen=True, slots=True, eq=False)
class Present:
    """Everyone who exists at a time, in the order of the trajectories.

    Attributes:
        time: SUMO's [s].
        users: Index of each road user, (n,).
        pieces: Index of its stretch of motion, (n,).
        positions: Front's middle on the ground, (n, 3) [m].
        yaws: (n,) [rad].
        pitches: Nose up, (n,) [rad].
        speeds: (n,) [m/s].
        travelled: Since the stretch began, (n,) [m].
    """

    time: float
    users: Ints
    pieces: Ints
    positions: Floats
    yaws: Floats
    pitches: Floats
    speeds: Floats
    travelled: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _MotionBlock:
    """Motion of all stretches that live within a block: (p,), (t,) and (p, t, columns)."""

    pieces: Ints
    times: Floats
    values: Floats


class Presence:
    """Looks up who exists at a time."""

    def __init__(self, trajectories: Sequence[Trajectory], times: Floats | None = None) -> None:
        """Index the stretches of motion.

        Args:
            trajectories: Of all road users.
            times: Of a shot's frames, increasing, (n,) [s]; other times take longer.
        """
        owned = [(k, piece) for k, t in enumerate(trajectories) for piece in t.pieces]
        self.pieces: tuple[MotionPiece, ...] = tuple(piece for _, piece in owned)
        self.owners: Ints = np.array([k for k, _ in owned], dtype=np.int64)
        lives = [(piece.begin, piece.end) for _, piece in owned]
        self.lives: Floats = np.array(lives, dtype=np.float64).reshape(-1, 2)
        self._times = np.empty(0) if times is None else np.asarray(times, dtype=np.float64)
        self._kept: tuple[int, _MotionBlock] | None = None

    def at(self, time: float) -> Present:
        """Return everyone who exists at a time [s]."""
        block = self._block(time)
        alive = self._alive(np.array([time]))[block.pieces, 0]
        column = int(np.searchsorted(block.times, time))
        values = block.values[alive, column]
        pieces = block.pieces[alive]
        users = self.owners[pieces]
        return Present(time, users, pieces, values[:, :3], *values[:, 3:].T)

    def _block(self, time: float) -> _MotionBlock:
        """The block that a time belongs to, from the last call or new."""
        index = int(np.searchsorted(self._times, time))
        if index == len(self._times) or self._times[index] != time:
            return self._sampled(np.array([time]))
        number = index // BLOCK
        kept = self._kept
        if kept is None or kept[0] != number:
            kept = number, self._sampled(self._times[number * BLOCK : (number + 1) * BLOCK])
            self._kept = kept
        return kept[1]

    def _sampled(self, times: Floats) -> _MotionBlock:
        """Sample everyone who exists at some of the times."""
        alive = self._alive(times)
        pieces = np.flatnonzero(alive.any(axis=1))
        values = np.empty((len(pieces), len(times), _COLUMNS))
        for row, number in enumerate(pieces.tolist()):
            live = alive[number]
            begin, end = self.lives[number]
            motion = self.pieces[number].sample(np.clip(times[live], begin, end))
            values[row, live, :3] = motion.positions
            values[row, live, 3], values[row, live, 4] = motion.yaws, motion.pitches
            values[row, live, 5], values[row, live, 6] = motion.speeds, motion.travelled
        return _MotionBlock(pieces, times, values)

    def _alive(self, times: Floats) -> Bools:
        """Which stretches exist at which times, (p, t)."""
        begin, end = self.lives[:, :1], self.lives[:, 1:]
        return np.asarray((begin - 1e-9 <= times) & (times <= end + 1e-9))
