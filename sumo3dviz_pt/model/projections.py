"""How cameras lay directions out in a picture: perspective, parallel, fisheye, equirectangular.

Places in a picture are two numbers: `left` and `up` go from 1 at its left and upper edge to -1 at
its right and lower one, in units of what those edges stand for. Directions are in the camera's
frame, +x forward, +y left, +z up. A projection is a class of this module, an entry of `KINDS` and a
row of `PROJECTIONS` in `model/numbers.py`. Rays are the same lines of code for NumPy and for the
kernel, which gives its own `ArrayMath`.

References:
    Fisheyes are equidistant: the angle from the axis is proportional to the distance from the
        picture's middle (Kannala and Brandt, IEEE TPAMI 28, 2006, doi:10.1109/TPAMI.2006.153).
    Distortion is radial, as OpenCV writes it (Brown, "Close-range camera calibration",
        Photogrammetric Engineering 37, 1971): r' = r (1 + k1 r^2 + k2 r^4), of slopes r.
    Omnidirectional stereo: Peleg, Ben-Ezra and Pritch, "Omnistereo: panoramic stereo imaging",
        IEEE TPAMI 23, 2001, doi:10.1109/34.910880.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.numbers import Projection

Distortion = tuple[float, float]
Triple = tuple[Any, Any, Any]
"""Coordinates in the camera's frame, forward, left and up, of any kind of arrays."""

_STEEPEST = 100.0
"""Slopes beyond this lie outside of any picture."""

_NOTHING = 1e-12
"""So near to the eye nothing is seen [m]."""

_NEWTON = 8
"""Steps that find a slope from where distortion puts it."""

WIDE = float(np.radians(179.0))
"""Rays farther than half of this from the axis have no slope [rad]."""


class ArrayMath(Protocol):
    """What rays are worked out with, in one kind of arrays."""

    def cos(self, value: Any) -> Any:
        """Return cosines."""

    def sincos(self, value: Any) -> tuple[Any, Any]:
        """Return sines and cosines."""

    def hypot(self, one: Any, other: Any) -> Any:
        """Return lengths of two sides together."""

    def arctan2(self, one: Any, other: Any) -> Any:
        """Return angles of which two sides are given, the far one first."""

    def arcsin(self, value: Any) -> Any:
        """Return angles of sines."""

    def sqrt(self, value: Any) -> Any:
        """Return roots."""

    def floor(self, value: Any) -> Any:
        """Return the next lower whole numbers."""

    def clip(self, value: Any, low: Any, high: Any) -> Any:
        """Return values within bounds."""

    def sinc(self, value: Any) -> Any:
        """Return sines over their angles, 1 at 0."""

    def select(self, where: Any, one: Any, other: Any) -> Any:
        """Return one value where something holds, and another elsewhere."""

    def stretch(self, slopes: Any, distortion: Any) -> Any:
        """Return the factor by which distortion stretches slopes."""


class NumpyMath:
    """The same of NumPy, in double precision."""

    def cos(self, value: Any) -> Any:
        """Return cosines."""
        return np.cos(value)

    def sincos(self, value: Any) -> tuple[Any, Any]:
        """Return sines and cosines."""
        return np.sin(value), np.cos(value)

    def hypot(self, one: Any, other: Any) -> Any:
        """Return lengths of two sides together."""
        return np.hypot(one, other)

    def arctan2(self, one: Any, other: Any) -> Any:
        """Return angles of which two sides are given, the far one first."""
        return np.arctan2(one, other)

    def arcsin(self, value: Any) -> Any:
        """Return angles of sines."""
        return np.arcsin(value)

    def sqrt(self, value: Any) -> Any:
        """Return roots."""
        return np.sqrt(value)

    def floor(self, value: Any) -> Any:
        """Return the next lower whole numbers."""
        return np.floor(value)

    def clip(self, value: Any, low: Any, high: Any) -> Any:
        """Return values within bounds."""
        return np.clip(value, low, high)

    def sinc(self, value: Any) -> Any:
        """Return sines over their angles, 1 at 0."""
        return np.sinc(value / np.pi)

    def select(self, where: Any, one: Any, other: Any) -> Any:
        """Return one value where something holds, and another elsewhere."""
        return np.where(where, one, other)

    def stretch(self, slopes: Any, distortion: Any) -> Any:
        """Return the factor by which distortion stretches slopes."""
        return distorted(slopes, distortion)


NUMPY = NumpyMath()


# Distortion -------------------------------------------------------------------------------------


def distorted(slopes: Floats, distortion: Distortion) -> Floats:
    """Return the factor by which distortion stretches slopes, of lengths (...).

    Where the polynomial would turn back, which is outside of any picture, slopes are only moved.
    """
    end = turning(distortion)
    inside = np.minimum(slopes, end)
    square = np.square(inside)
    stretch = 1.0 + square * (distortion[0] + distortion[1] * square)
    outside = inside * stretch + (slopes - inside)
    return np.divide(outside, slopes, out=np.asarray(stretch), where=slopes > end)


def turning(distortion: Distortion) -> float:
    """Return the least slope at which distortion turns back, or one outside of any picture."""
    first, second = 3.0 * distortion[0], 5.0 * distortion[1]
    roots = np.roots([second, first, 1.0]) if any(distortion) else np.zeros(0)
    ends = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
    return float(np.sqrt(min([*ends, _STEEPEST**2])))


def undistorted(m: ArrayMath, lengths: Any, distortion: tuple[Any, Any]) -> Any:
    """Return the slopes that distortion puts at lengths from the middle."""
    first, second = distortion
    slopes = lengths + 0.0
    for _ in range(_NEWTON):
        square = slopes * slopes
        value = slopes * m.stretch(slopes, distortion)
        steepness = 1.0 + square * (3.0 * first + 5.0 * second * square)
        slopes = slopes - (value - lengths) / steepness
    return slopes


def folds(length: float, distortion: Distortion) -> bool:
    """Return whether distortion maps two slopes to one place, up to a length from the middle."""
    lengths = np.linspace(0.0, length, 65)
    slopes = undistorted(NUMPY, lengths, distortion)
    square = np.square(slopes)
    steep = 1.0 + square * (3.0 * distortion[0] + 5.0 * distortion[1] * square)
    back = slopes * distorted(slopes, distortion) - lengths
    return bool((steep <= 0.05).any() or (np.abs(back) > 1e-6).any() or (slopes < 0.0).any())


# Kinds ------------------------------------------------------------------------------------------


class EyeNumbers(Protocol):
    """What places hang on besides what the edges stand for; see `Lens`."""

    @property
    def distortion(self) -> Any:
        """Radial; None is none, too."""

    @property
    def shift(self) -> Any:
        """Of the eye to the left [m]."""


class LensNumbers(EyeNumbers, Protocol):
    """What a projection must know of a lens; see `Lens`."""

    @property
    def opening(self) -> float:
        """Horizontal opening angle [rad]."""

    @property
    def width(self) -> float:
        """Of what parallel rays show [m]."""

    @property
    def half_width(self) -> float:
        """Half the picture's width one metre ahead [m]."""


class Fisheye:
    """Equidistant, and what holds for all projections that lay out angles.

    Attributes:
        is_flat: Whether its picture is a plane before the eye: places are slopes.
        is_parallel: Whether rays are parallel: places are metres.
        goes_round: Whether columns go around, so that the left edge meets the right one.
        sees_behind: Whether what lies behind the eye may lie in the picture.
    """

    is_flat = False
    is_parallel = False
    goes_round = False
    sees_behind = True

    def edges(self, lens: LensNumbers, aspect: float) -> tuple[float, float]:
        """Return what the left and upper edge stand for, of height / width; here angles [rad]."""
        return 0.5 * lens.opening, 0.5 * lens.opening * aspect

    def half_diagonal(self, lens: LensNumbers, aspect: float) -> float:
        """Return the angle from the axis to the farthest corner [rad]."""
        return float(min(np.pi, lens.opening / 2.0 * np.hypot(1.0, aspect)))

    def pixel_width(self, lens: LensNumbers, width: float) -> float:
        """Return the width of one of so many pixels in the middle, one metre ahead [m]."""
        return lens.opening / width

    def length_of(self, lens: LensNumbers, share: float, away: Floats) -> Floats:
        """Return how long things are that take up a share of the width, by distance [m]."""
        return np.asarray(share * lens.opening * away)

    def rays(
        self, m: ArrayMath, left: Any, up: Any, *, shift: Any, distortion: Any
    ) -> tuple[Triple, Triple]:
        """Return where rays through places begin [m], and their directions.

        Directions are unit ones, but for flat pictures.

        Args:
            m: Of the arrays' kind.
            left: Places, in units of what the edges stand for.
            up: The same.
            shift: Of the eye to the left [m].
            distortion: Its two numbers; None if there is none.
        """
        angle = m.hypot(left, up)
        share = m.sinc(angle)
        return (0.0, shift, 0.0), (m.cos(angle), share * left, share * up)

    def places(self, m: ArrayMath, eye: EyeNumbers, point: Triple) -> tuple[Any, Any]:
        """Return where points in the camera's frame [m] lie: to the left, and up."""
        forward, left, up = point
        left = left - eye.shift
        aside = m.hypot(left, up)
        scale = m.arctan2(aside, forward) / m.select(aside > 0.0, aside, 1.0)
        return left * scale, up * scale


class Equirectangular(Fisheye):
    """Columns are turns, rows are heights above the horizon."""

    goes_round = True

    def edges(self, lens: LensNumbers, aspect: float) -> tuple[float, float]:
        """Return the turn and the rise of the edges [rad]."""
        return 0.5 * lens.opening, 0.5 * np.pi

    def half_diagonal(self, lens: LensNumbers, aspect: float) -> float:
        """Return the angle from the axis to the farthest corner [rad]."""
        return float(max(lens.opening / 2.0, np.pi / 2.0))

    def rays(
        self, m: ArrayMath, left: Any, up: Any, *, shift: Any, distortion: Any
    ) -> tuple[Triple, Triple]:
        """Return rays; they begin on the circle on which the eye goes around."""
        sine, cosine = m.sincos(left)
        rise, flat = m.sincos(up)
        return (-shift * sine, shift * cosine, 0.0), (flat * cosine, flat * sine, rise)

    def places(self, m: ArrayMath, eye: EyeNumbers, point: Triple) -> tuple[Any, Any]:
        """Return at which turn and rise an eye on the viewing circle sees points [rad]."""
        forward, left, up = point
        away = m.hypot(forward, left)
        turn = m.arctan2(left, forward)
        if isinstance(eye.shift, float) and eye.shift == 0.0:
            return turn, m.arctan2(up, away)
        far = m.select(away > _NOTHING, away, _NOTHING)
        turn = turn - m.arcsin(m.clip(eye.shift / far, -1.0, 1.0))
        turn = turn - 2.0 * np.pi * m.floor(turn / (2.0 * np.pi) + 0.5)
        square = away * away - eye.shift * eye.shift
        return turn, m.arctan2(up, m.sqrt(m.select(square > 0.0, square, 0.0)))


class Perspective(Fisheye):
    """A plane before the eye."""

    is_flat = True
    sees_behind = False

    def edges(self, lens: LensNumbers, aspect: float) -> tuple[float, float]:
        """Return the slopes of the edges."""
        return lens.half_width, lens.half_width * aspect

    def half_diagonal(self, lens: LensNumbers, aspect: float) -> float:
        """Return the angle from the axis to the farthest corner [rad]."""
        corner = lens.half_width * np.hypot(1.0, aspect)
        if any(lens.distortion):
            corner = float(undistorted(NUMPY, np.array(corner), lens.distortion))
        return float(np.arctan(corner))

    def pixel_width(self, lens: LensNumbers, width: float) -> float:
        """Return the width of one of so many pixels in the middle, one metre ahead [m]."""
        return 2.0 * lens.half_width / width

    def length_of(self, lens: LensNumbers, share: float, away: Floats) -> Floats:
        """Return how long things are that take up a share of the width, by distance [m]."""
        return np.asarray(share * 2.0 * lens.half_width * away)

    def rays(
        self, m: ArrayMath, left: Any, up: Any, *, shift: Any, distortion: Any
    ) -> tuple[Triple, Triple]:
        """Return rays; directions reach the plane one metre ahead."""
        if distortion is not None:
            length = m.hypot(left, up)
            stretch = undistorted(m, length, distortion) / m.select(length > 0.0, length, 1.0)
            left, up = left * stretch, up * stretch
        return (0.0, shift, 0.0), (1.0, left, up)

    def places(self, m: ArrayMath, eye: EyeNumbers, point: Triple) -> tuple[Any, Any]:
        """Return at which slopes points are seen."""
        forward, left, up = point
        ahead = m.select(forward > 0.0, forward, np.inf)
        left, up = (left - eye.shift) / ahead, up / ahead
        if eye.distortion is None:
            return left, up
        stretch = m.stretch(m.hypot(left, up), eye.distortion)
        return left * stretch, up * stretch


class Orthographic(Perspective):
    """Parallel rays, as of a plan."""

    is_flat = False
    is_parallel = True

    def edges(self, lens: LensNumbers, aspect: float) -> tuple[float, float]:
        """Return how far off the axis the edges are [m]."""
        return 0.5 * lens.width, 0.5 * lens.width * aspect

    def half_diagonal(self, lens: LensNumbers, aspect: float) -> float:
        """Return half a turn: what is seen lies in no cone."""
        return float(np.pi)

    def pixel_width(self, lens: LensNumbers, width: float) -> float:
        """Return the width of one of so many pixels [m]."""
        return lens.width / width

    def length_of(self, lens: LensNumbers, share: float, away: Floats) -> Floats:
        """Return how long things are that take up a share of the width, at any distance [m]."""
        return np.full_like(away, share * lens.width)

    def rays(
        self, m: ArrayMath, left: Any, up: Any, *, shift: Any, distortion: Any
    ) -> tuple[Triple, Triple]:
        """Return rays straight ahead, each from its own place."""
        return (0.0, left, up), (1.0, 0.0, 0.0)

    def places(self, m: ArrayMath, eye: EyeNumbers, point: Triple) -> tuple[Any, Any]:
        """Return how far off the axis points lie [m]."""
        return point[1], point[2]


KINDS: Mapping[Projection, Fisheye] = MappingProxyType(
    {
        "perspective": Perspective(),
        "orthographic": Orthographic(),
        "fisheye": Fisheye(),
        "equirectangular": Equirectangular(),
    }
)
"""What is known of each projection, by its name in scene files."""
