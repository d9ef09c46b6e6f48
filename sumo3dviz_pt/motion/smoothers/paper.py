"""The founding paper's smoother, exactly as described, and in continuous time.

In `paper`, the angle is unwrapped; positions and angle are interpolated linearly to 25 frames a
second, counted from the first sample; a centred moving average over 21 frames smooths them,
truncated at the ends; the heading comes from the increments of the smoothed positions where a step
exceeds 0.03 m, else the smoothed SUMO angle is kept; a centred moving average over 41 frames
smooths the unwrapped heading. Between its frames the result is interpolated linearly; after the
last frame it is held. The truncated windows pull the first and last positions inwards by up to
0.2 s of driving.

In `paper_symmetric`, the windows of 21 and 41 frames at 25 frames a second are 0.84 s and 1.64 s of
continuous time. They shrink symmetrically towards the ends of a motion piece, so that the first and
last positions are exact and neither the frame rate nor the shown window of time changes anything.
The heading is that of the smoothed velocity where it exceeds 0.75 m/s (0.03 m a frame), else the
smoothed SUMO angle. It is unwrapped towards SUMO's angle, so that a car that waits or sets off
never spins.

Where the velocity points far off SUMO's angle, the vehicle reverses or changes lanes within
one step at walking pace. SUMO's angle is kept there.

The paper's networks are flat. Here height and slope have a window of their own, 0.2 s:
over 0.84 s a car sinks up to 1.9 m into a crest that it passes at 20 m/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.front import Front, FrontMotion, Hermite, monotone_slopes
from sumo3dviz_pt.motion.manoeuvres import aligned, calmed, leeway, room_on_the_spot, turning_room
from sumo3dviz_pt.motion.samples import LoggedSamples, PiecewiseLinear, absolute_times, nearest_turn
from sumo3dviz_pt.motion.setting import Setting
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


POSITION_HALF_WIDTH = 0.42
"""Half the window of positions and of SUMO's angle [s]."""

HEIGHT_HALF_WIDTH = 0.1
"""Half the window of heights and slopes [s]; rounds the road's kinks but stays on the road."""

HEADING_HALF_WIDTH = 0.82
"""Half the window of the heading [s]."""

SLOWEST = 0.75
"""Slower than this the velocity says nothing about the heading [m/s]."""

LARGEST_CRAB = np.pi / 3
"""Largest angle between velocity and SUMO's angle at which the velocity leads [rad]."""

HEADING_STEP = 0.02
"""Directions are taken at multiples of this time, and at both ends of a piece [s]."""

SHOWN_STEP = 0.1
"""Averaged headings are known at multiples of this time, and at both ends of a piece [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class SmoothFront:
    """Moving averages that are known at any time.

    Attributes:
        origin: Position that is subtracted from all others to keep their digits, (3,) [m].
        path: x, y and SUMO's unwrapped yaw, (n, 3).
        rise: z and slope, (n, 2).
        heading: Yaw over time [rad].
        remarks: What was noticed.
    """

    origin: Floats
    path: PiecewiseLinear
    rise: PiecewiseLinear
    heading: Hermite
    remarks: tuple[Remark, ...] = ()

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return float(self.path.knots[0])

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return float(self.path.knots[-1])

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        path, rates = self.path.average(times, half_width=POSITION_HALF_WIDTH)
        rise, climbs = self.rise.average(times, half_width=HEIGHT_HALF_WIDTH)
        return FrontMotion(
            np.column_stack([path[:, :2], rise[:, 0]]) + self.origin,
            np.linalg.norm(np.column_stack([rates[:, :2], climbs[:, 0]]), axis=1),
            self.heading.at(times)[0],
            rise[:, 1],
        )


@register("paper_symmetric", heads=True, blur=POSITION_HALF_WIDTH + HEADING_HALF_WIDTH)
def paper_symmetric(samples: LoggedSamples, setting: Setting) -> Front:
    """Smooth in continuous time, with exact ends."""
    origin = samples.positions[0]
    place = samples.positions - origin
    path = PiecewiseLinear.through(samples.times, np.column_stack([place[:, :2], samples.yaws]))
    rise = PiecewiseLinear.through(samples.times, np.column_stack([place[:, 2], samples.slopes]))
    return SmoothFront(origin, path, rise, _heading(path, samples, setting))


def _heading(path: PiecewiseLinear, samples: LoggedSamples, setting: Setting) -> Hermite:
    """Return the averaged heading, near the log's angles and turned only as the body drives."""
    begin, end = float(samples.times[0]), float(samples.times[-1])
    knots = absolute_times(begin, end, step=HEADING_STEP)
    raw = PiecewiseLinear.through(knots, _paper_symmetric_headings(path, knots))
    shown = absolute_times(begin, end, step=SHOWN_STEP)
    yaws = raw.average(shown, half_width=HEADING_HALF_WIDTH)[0][:, 0]
    if setting.kind == "person":
        room = room_on_the_spot(shown, samples)
    else:
        places = path.average(shown, half_width=POSITION_HALF_WIDTH)[0][:, :2]
        ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
        room = turning_room(shown, np.concatenate([[0.0], np.cumsum(ways)]), setting.length)
    near = leeway(shown, yaws, samples)
    calm = calmed(room, aligned(yaws, near), near)
    return Hermite(shown, calm, monotone_slopes(shown, calm))


def _paper_symmetric_headings(path: PiecewiseLinear, times: Floats) -> Floats:
    """Return the unwrapped yaw of the velocity, or SUMO's where that is better, (m, 1) [rad]."""
    averages, rates = path.average(times, half_width=POSITION_HALF_WIDTH)
    angles = averages[:, 2]
    along = nearest_turn(np.arctan2(rates[:, 1], rates[:, 0]), angles)
    fast = np.hypot(rates[:, 0], rates[:, 1]) > SLOWEST
    led = fast & (np.abs(along - angles) <= LARGEST_CRAB)
    return np.where(led, along, angles)[:, None]
