"""The founding paper's smoother, exactly as it is described.

The angle is unwrapped; positions and angle are interpolated linearly to 25 frames a
second, counted from the first sample; a centred moving average over 21 frames smooths
them, truncated at the ends; the heading comes from the increments of the smoothed
positions where a step exceeds 0.03 m, else the smoothed SUMO angle is kept; a centred
moving average over 41 frames smooths the unwrapped heading. Between its frames the
result is interpolated linearly; after the last frame it is held.

The truncated windows pull the first and last positions inwards by up to 0.2 s of
driving; the smoother `paper_symmetric` avoids that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.front import Front, FrontMotion
from sumo3dviz_pt.motion.smoothers.registry import register

FRAME_RATE = 25.0
"""Frames per second of the paper's films [1/s]."""

POSITION_FRAMES = 21
"""Window over which positions and angle are averaged [frames]."""

HEADING_FRAMES = 41
"""Window over which the heading is averaged [frames]."""

SHORTEST_STEP = 0.03
"""Steps between frames of up to this length say nothing about the heading [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameFront:
    """Motion known at frames and interpolated between them.

    Attributes:
        begin: First sample's time [s].
        end: Last sample's time [s]; up to a frame later than the last frame.
        frames: Times of the frames, (n,) [s].
        positions: Positions at the frames, (n, 3) [m].
        headings: Unwrapped, (n,) [rad].
        pitches: (n,) [rad].
        remarks: What was noticed.
    """

    begin: float
    end: float
    frames: Floats
    positions: Floats
    headings: Floats
    pitches: Floats
    remarks: tuple[Remark, ...] = ()

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        columns = [np.interp(times, self.frames, column) for column in self.positions.T]
        return FrontMotion(
            np.stack(columns, axis=1),
            self._speeds(times),
            np.interp(times, self.frames, self.headings),
            np.interp(times, self.frames, self.pitches),
        )

    def _speeds(self, times: Floats) -> Floats:
        """Return the mean speed between the frames around each time, (n,) [m/s]."""
        if len(self.frames) < 2:
            return np.zeros(len(times))
        steps = np.linalg.norm(np.diff(self.positions, axis=0), axis=1) * FRAME_RATE
        index = np.searchsorted(self.frames, times, side="right") - 1
        return np.asarray(steps[np.clip(index, 0, len(steps) - 1)])


@register("paper", heads=True, blur=(POSITION_FRAMES + HEADING_FRAMES) / 2 / FRAME_RATE, raw=True)
def paper(samples: LoggedSamples, setting: Setting) -> Front:
    """Smooth as the founding paper does."""
    del setting  # the paper uses positions and angles only
    begin, end = float(samples.times[0]), float(samples.times[-1])
    count = int(np.floor((end - begin) * FRAME_RATE + 1e-6)) + 1
    frames = begin + np.arange(count) / FRAME_RATE
    columns = np.column_stack([samples.positions, samples.yaws, samples.slopes])
    # Averages near zero keep their digits, wherever in the world the road lies.
    origin = columns[0]
    drawn = np.stack([np.interp(frames, samples.times, c) for c in (columns - origin).T], axis=1)
    smooth = origin + _moving_average(drawn, window=POSITION_FRAMES)
    headings = _headings(smooth[:, :2], angles=smooth[:, 3])
    headings = _moving_average(headings[:, None], window=HEADING_FRAMES)[:, 0]
    return FrameFront(begin, end, frames, smooth[:, :3], headings, smooth[:, 4])


def _moving_average(values: Floats, *, window: int) -> Floats:
    """Return centred means over a window of frames, (n, k); the window is cut at the ends."""

    def sums(column: Floats) -> Floats:
        total = uniform_filter1d(column, size=window, axis=0, mode="constant", cval=0.0)
        return np.asarray(total * window)

    return sums(values) / np.round(sums(np.ones((len(values), 1))))


def _headings(positions: Floats, *, angles: Floats) -> Floats:
    """Return the direction of each step, or SUMO's angle where it is short; unwrapped, (n,)."""
    steps = np.diff(positions, axis=0, prepend=positions[:1])
    moving = np.linalg.norm(steps, axis=1) > SHORTEST_STEP
    return np.unwrap(np.where(moving, np.arctan2(steps[:, 1], steps[:, 0]), angles))
