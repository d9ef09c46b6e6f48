"""Ranges of numbers, exact ratios, time zones, and words for pictures; they load nothing.

The ranges hold in all files; everything that can drive lies within them. Frame rates and speeds of
films are exactly what is written. Time zones are named as people write them.
"""

from __future__ import annotations

import datetime as dt
import difflib
import re
import zoneinfo
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal


@dataclass(frozen=True, slots=True)
class Range:
    """A range of allowed numbers.

    Attributes:
        low: Smallest allowed number.
        high: Largest allowed number.
        unit: Unit of both, for messages; empty for counts and bits.
    """

    low: float
    high: float
    unit: str = ""

    def __contains__(self, number: float) -> bool:
        """Whether a number lies within; NaN does not."""
        return self.low <= number <= self.high

    def __str__(self) -> str:
        """Return the range in words, such as `from 0 to 1000 m/s`."""
        return f"from {self.low:.12g} to {self.high:.12g} {self.unit}".rstrip()


COORDINATE = Range(-2e7, 2e7, "m")
"""Coordinates: half of the Earth's circumference, as far as any map projection reaches."""

HEIGHT = Range(-2e4, 2e4, "m")
"""Heights: twice that of the highest mountain."""

SECONDS = Range(-1e9, 1e9, "s")
"""Times: thirty years before and after zero."""

ANGLE = Range(-3600.0, 3600.0, "degrees")
"""Angles: ten turns."""

MOST_FRAMES = 1_000_000
"""Largest number of frames of a film, eleven hours at 25 a second."""


def eased(share: Any, height: Any = 1.0) -> Any:
    """Return a smooth S of shares in [0, 1], from 0 up to a height: 3 s^2 - 2 s^3 of it.

    Args:
        share: Numbers of any kind: Python's, NumPy's or Dr.Jit's.
        height: Where it ends.
    """
    return height * share * share * (3.0 - 2.0 * share)


_WRITTEN = re.compile(r"\+?(\d{1,9}(\.\d{0,9})?|\.\d{1,9})(\s*/\s*\d{1,9})?")

Ratio = Fraction | float | str
"""A positive number, or a ratio such as `30000/1001`."""


def ratio_of(value: Ratio) -> Fraction:
    """Return a number exactly as it is written: 29.97 becomes 2997/100.

    Args:
        value: A number, a ratio, or text of one.

    Raises:
        ValueError: If it is no number, or not positive.
    """
    text = f"{value:.9f}" if isinstance(value, float) and abs(value) < 1e9 else str(value).strip()
    plain = not isinstance(value, bool) and _WRITTEN.fullmatch(text) is not None
    numerator, _, denominator = text.partition("/")
    if not plain or Fraction(denominator or 1) == 0 or Fraction(numerator) == 0:
        raise ValueError(f"write a positive number or a ratio such as 30000/1001, not {value!r}")
    return Fraction(numerator) / Fraction(denominator or 1)


def counted(count: int, name: str) -> str:
    """Return how many there are: `1 frame`, `2 frames`."""
    return f"{count} {name}" if count == 1 else f"{count} {name}s"


def in_short(ratio: Fraction) -> int | float | str:
    """Return a ratio as a number where that is exact, else as text such as `30000/1001`."""
    if ratio.denominator == 1:
        return int(ratio)
    number = float(ratio)
    return number if Fraction(repr(number)) == ratio else str(ratio)


SOLAR = "solar"
"""Mean solar time of the place: the sun stands highest within 16 minutes of noon."""

_FIXED = re.compile(r"([+-])(\d{1,2})(?::?([0-5]\d))?")


def zone_named(name: str) -> dt.tzinfo:
    """Return a time zone.

    Args:
        name: A name of the IANA time zones, such as `Europe/Berlin`, or an offset from UTC, such
            as `+02:00`.

    Raises:
        ValueError: If there is none of that name; the message suggests one.
    """
    fixed = _FIXED.fullmatch(name)
    if fixed is not None:
        sign = -1 if fixed[1] == "-" else 1
        ahead = dt.timedelta(hours=int(fixed[2]), minutes=int(fixed[3] or 0))
        if ahead > dt.timedelta(hours=14):
            raise ValueError(f"no clock is further than 14 hours from UTC, not {name}")
        return dt.timezone(sign * ahead)
    try:
        return zoneinfo.ZoneInfo(name)
    except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
        known = sorted(zoneinfo.available_timezones())
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    hint = f"did you mean {near[0]!r}?" if near else "write it like Europe/Berlin or +02:00"
    raise ValueError(f"no time zone is called {name!r}; {hint}")


PROJECTIONS: Mapping[str, float | None] = {
    "perspective": None,
    "orthographic": None,
    "fisheye": 180.0,
    "equirectangular": 360.0,
}
"""Kinds of pictures, with the opening angle of a lens that says none [deg]; None is the camera's.
What they are is said in `model/projections.py`."""

Stereo = Literal["none", "side_by_side", "top_bottom"]

ResponseName = Literal["none", "dashcam", "cinema"]
"""What a camera does to a picture; see `image/response.py`."""


@dataclass(frozen=True, slots=True)
class LayerKind:
    """A layer that can be written beside a film.

    Attributes:
        cpu: What finding and writing it costs, for each million pixels [CPU-s].
        stored: Bytes of its file, for each pixel.
        rays: What rays through pixels' centres are asked for it, by the kernel's names.
        channels: Its channels in the frame's EXR; none if it has a file of its own.
        dtype: What these are stored as.
        names: Whether it shows things, whose names are said beside it.
    """

    cpu: float
    stored: float
    rays: frozenset[str] = frozenset()
    channels: tuple[str, ...] = ()
    dtype: str = ""
    names: bool = False


_OWNER = frozenset({"depth", "face", "instance"})
"""Rays that tell whose a pixel is."""

LAYER_KINDS: Mapping[str, LayerKind] = {
    # layer                   CPU-s/Mpx  B/px  rays, channels, precision
    "depth": LayerKind(0.07, 3.0, frozenset({"depth"}), ("Z",), "float32"),
    "normals": LayerKind(0.07, 1.6, frozenset({"normals"}), ("X", "Y", "Z"), "float16"),
    "albedo": LayerKind(0.07, 1.75, frozenset({"albedo"}), ("R", "G", "B"), "float16"),
    "ids": LayerKind(3.4, 0.75, _OWNER, names=True),
    "instance": LayerKind(0.07, 0.15, _OWNER, ("id",), "uint32", names=True),
    "semantic": LayerKind(0.07, 0.05, _OWNER, names=True),
    "flow": LayerKind(0.45, 0.6, _OWNER | {"corners"}),
    "boxes2d": LayerKind(0.07, 0.0, _OWNER, names=True),
    "boxes3d": LayerKind(0.07, 0.0, _OWNER, names=True),
    "lamps": LayerKind(0.0, 0.0),
}
"""What can be written of every frame of a film, by name; see the manual's page on layers. How one
with a file of its own is written and read is said in `pipeline/films/layers.py`."""

if TYPE_CHECKING:
    LayerName = str
    Projection = str
else:
    Projection = Literal[tuple(PROJECTIONS)]
    LayerName = Literal[tuple(LAYER_KINDS)]

# fmt: off
TableRole = Literal[
    "time", "frame", "id", "x", "y", "z", "rear_x", "rear_y", "angle", "speed", "length", "width",
    "height", "class",
]
TableUnit = Literal[
    "s", "ms", "us", "ns", "m", "mm", "cm", "km", "ft", "m/s", "km/h", "mph", "ft/s", "deg", "rad",
]
TablePoint = Literal["front", "centre", "rear"]
# fmt: on
"""What columns of a table of trajectories hold, what their numbers are in, and where on a body
x and y are."""
