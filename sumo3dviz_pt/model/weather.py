"""The weather as values, of one moment and over time, how much daylight passes it, and clouds.

Rates of rain and snow are in millimetres of water an hour, as all measured relations take them.

Light passes the clouds that rain and snow fall from, and fog. Such a layer of droplets takes hardly
any light, but sends much of it back up. What passes is the two-stream answer for light that is
scattered and never absorbed; light that the ground sends up is partly sent down again, so snow
makes dull days brighter.

References:
    Shettle, E. P. and Weinman, J. A., The transfer of solar irradiance through inhomogeneous
    turbid atmospheres evaluated by Eddington's approximation, Journal of the Atmospheric Sciences
    27, 1970, doi:10.1175/1520-0469(1970)027<1048:TTOSIT>2.0.CO;2 (conservative layer).
    Joseph, J. H., Wiscombe, W. J. and Weinman, J. A., The delta-Eddington approximation for
    radiative flux transfer, Journal of the Atmospheric Sciences 33, 1976,
    doi:10.1175/1520-0469(1976)033<2452:TDEAFR>2.0.CO;2.
    Stephens, G. L., Radiation profiles in extended water clouds II, Journal of the Atmospheric
    Sciences 35, 1978, doi:10.1175/1520-0469(1978)035<2123:RPIEWC>2.0.CO;2 (optical depths of
    stratus and nimbostratus, 20 to over 100).
    Koschmieder, H., Theorie der horizontalen Sichtweite, Beitraege zur Physik der freien
    Atmosphaere 12, 1924: contrast falls as exp(-extinction x distance).
    Weber, M. et al., 2015: extinction of rain, .312 R^.67 per kilometre.
    Rasmussen, R. M. et al., The estimation of snowfall rate using visibility, Journal of Applied
    Meteorology 38, 1999: light, moderate and heavy snow part at 1 and 2.5 mm/h, and visibility
    at 1 and .5 km, so that extinction is about 3 per kilometre for each mm/h.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from sumo3dviz_pt.model.geometry import Image

CONTRAST = -math.log(0.02)
"""Optical depth at which a black thing keeps 2 % of contrast."""

ASYMMETRY = 0.85
"""Mean cosine of the angle by which droplets scatter light; .84 to .87 in fog and cloud."""

_MURKY, _DENSE = 500.0, 75.0
"""Visibilities below which lamps are lit by day, and rear fog lamps [m].

German law (StVO section 17) asks for both: for lamps where fog, rain or snow hide much, and allows
rear fog lamps below 50 m, which drivers judge by the posts that stand beside roads.
"""

TOP = 200.0
"""Height of the top of fog that is equally dense [m]."""


@dataclass(frozen=True, slots=True)
class WeatherKind:
    """A kind of weather, such as rain: what all of the program asks of it.

    A kind is a class here and a field of `Weather`, a model of the same name in
    `job/surroundings.py`, and for what falls a row of `MATTERS` in `render/falling/drops.py` and a
    field of `Falling`.
    """

    @property
    def falling_rate(self) -> float:
        """How much of it falls, as water [mm/h]."""
        return 0.0

    @property
    def falling_extinction(self) -> float:
        """Extinction of the air by what of it falls [1/m]."""
        return 0.0

    @property
    def lights_lamps(self) -> bool:
        """Whether drivers light their lamps for it by day, however far one sees."""
        return False

    def between(self, later: Self, share: float) -> Self:
        """Return what is between this and a later one, by a share in [0, 1]; words stay."""
        mixed = {
            each.name: _mixed(getattr(self, each.name), getattr(later, each.name), share)
            for each in fields(self)
            if not isinstance(getattr(self, each.name), str)
        }
        return replace(self, **mixed)

    def in_words(self) -> tuple[str, ...]:
        """Return what there is of it."""
        return ()

    def account(self) -> dict[str, Any]:
        """Return it for JSON, with units in its keys; empty where there is nothing."""
        return {}


@dataclass(frozen=True, slots=True)
class Fog(WeatherKind):
    """Droplets in the air.

    Attributes:
        extinction: At the height `base` [1/m].
        height: In which the density falls to 1/e [m]; infinite for the same density everywhere.
        base: Height above which it falls [m]; below it the density stays.
    """

    extinction: float
    height: float = math.inf
    base: float = 0.0

    @property
    def visibility(self) -> float:
        """Distance at which a black thing keeps 2 % of contrast [m]."""
        return CONTRAST / self.extinction if self.extinction > 0.0 else math.inf

    @property
    def overhead(self) -> float:
        """Optical depth straight up from the base; even fog ends at `TOP`."""
        return self.extinction * min(self.height, TOP)

    def between(self, later: Self, share: float) -> Self:
        """Interpolate extinction, and the fall of density over height."""
        fall = _mixed(1.0 / self.height, 1.0 / later.height, share)
        extinction = _mixed(self.extinction, later.extinction, share)
        height = 1.0 / fall if fall > 0.0 else math.inf
        return replace(self, extinction=extinction, height=height)

    def in_words(self) -> tuple[str, ...]:
        """Return how far one sees."""
        if self.extinction <= 0.0:
            return ("no fog",)
        high = "" if math.isinf(self.height) else f", thinner above {self.height:.0f} m"
        return (f"fog, visibility {self.visibility:.0f} m{high}",)

    def account(self) -> dict[str, Any]:
        """Return how far one sees."""
        if self.extinction <= 0.0:
            return {}
        high = {} if math.isinf(self.height) else {"height_m": round(self.height, 2)}
        return {"visibility_m": round(self.visibility, 1), **high}


@dataclass(frozen=True, slots=True)
class Rain(WeatherKind):
    """Drops that fall.

    Attributes:
        rate: [mm/h].
    """

    rate: float

    @property
    def falling_rate(self) -> float:
        """How much falls [mm/h]."""
        return self.rate

    @property
    def falling_extinction(self) -> float:
        """Extinction of the air that they fall through [1/m]."""
        return 0.312e-3 * self.rate**0.67 if self.rate > 0.0 else 0.0

    @property
    def lights_lamps(self) -> bool:
        """Whether it is more than a drizzle."""
        return self.rate > 0.2

    def in_words(self) -> tuple[str, ...]:
        """Return how much falls."""
        return (f"rain of {self.rate:g} mm/h",)

    def account(self) -> dict[str, Any]:
        """Return how much falls."""
        return {"rate_mm_per_h": round(self.rate, 3)}


@dataclass(frozen=True, slots=True)
class Snow(WeatherKind):
    """Snow that lies, and snow that falls.

    Attributes:
        depth: Of what lies [m].
        roads: `cleared`, `tracked` or `covered`.
        falling: As water [mm/h].
    """

    depth: float = 0.0
    roads: str = "tracked"
    falling: float = 0.0

    @property
    def falling_extinction(self) -> float:
        """Extinction of the air that it falls through [1/m]."""
        return 3.0e-3 * self.falling

    @property
    def falling_rate(self) -> float:
        """How much falls, as water [mm/h]."""
        return self.falling

    @property
    def lights_lamps(self) -> bool:
        """Whether more than a few flakes fall."""
        return self.falling > 0.1

    def in_words(self) -> tuple[str, ...]:
        """Return how much lies and falls."""
        lies = (f"{100 * self.depth:.1f} cm of snow, roads {self.roads}",)
        falls = (f"snowfall of {self.falling:g} mm/h",)
        return (*(lies if self.depth > 0.0 else ()), *(falls if self.falling > 0.0 else ()))

    def account(self) -> dict[str, Any]:
        """Return how much lies and falls."""
        return {
            "depth_cm": round(100.0 * self.depth, 2),
            "roads": self.roads,
            "falling_mm_per_h": round(self.falling, 3),
        }


@dataclass(frozen=True, slots=True)
class Wind(WeatherKind):
    """Air that moves.

    Attributes:
        east: Towards the east [m/s].
        north: Towards the north [m/s].
    """

    east: float
    north: float

    @classmethod
    def coming(cls, speed: float, bearing: float) -> Wind:
        """Wind of a speed [m/s] that comes from a bearing, clockwise from north [rad]."""
        return cls(-speed * math.sin(bearing), -speed * math.cos(bearing))

    @property
    def speed(self) -> float:
        """How fast it is [m/s]."""
        return math.hypot(self.east, self.north)

    @property
    def bearing(self) -> float:
        """Where it comes from, clockwise from north [deg]."""
        return math.degrees(math.atan2(-self.east, -self.north)) % 360.0

    def in_words(self) -> tuple[str, ...]:
        """Return how fast it is and where it comes from."""
        return (f"wind of {self.speed:.1f} m/s from {self.bearing:.0f}\u00b0",)

    def account(self) -> dict[str, Any]:
        """Return how fast it is and where it comes from."""
        return {"speed_m_per_s": round(self.speed, 2), "from_deg": round(self.bearing, 1)}


FALLING_KINDS: Mapping[str, type[Rain | Snow]] = MappingProxyType({"rain": Rain, "snow": Snow})
"""What falls, by the names in scene files; their fields have the names of the keys there."""


@dataclass(frozen=True, slots=True)
class Weather:
    """The weather of one moment.

    Attributes:
        fog: Droplets in the air, or None.
        rain: Drops that fall, or None.
        wetness: Of what lies under the sky, [0, 1].
        puddles: Share of low places that are flooded, [0, 1].
        snow: What lies and falls, or None.
        wind: Air that moves, or None.
        season: `spring`, `summer`, `autumn` or `winter`.
    """

    fog: Fog | None = None
    rain: Rain | None = None
    wetness: float = 0.0
    puddles: float = 0.0
    snow: Snow | None = None
    wind: Wind | None = None
    season: str = "summer"

    @property
    def kinds(self) -> Mapping[str, WeatherKind]:
        """All that there is, by the names of the fields and in their order."""
        values = ((each.name, getattr(self, each.name)) for each in fields(self))
        return {name: kind for name, kind in values if isinstance(kind, WeatherKind)}

    @property
    def rates(self) -> Mapping[str, float]:
        """How much falls of what falls, by its name, as water [mm/h]."""
        return {
            name: kind.falling_rate for name, kind in self.kinds.items() if kind.falling_rate > 0.0
        }

    @property
    def is_murky(self) -> bool:
        """Whether drivers light their lamps by day: rain, falling snow, or little to be seen."""
        lamps = any(kind.lights_lamps for kind in self.kinds.values())
        return lamps or self.extinction > CONTRAST / _MURKY

    @property
    def is_dense(self) -> bool:
        """Whether drivers may light their rear fog lamps."""
        return self.extinction > CONTRAST / _DENSE

    @property
    def falls(self) -> float:
        """Extinction by what falls, the same at all heights [1/m]."""
        return sum(kind.falling_extinction for kind in self.kinds.values())

    @property
    def extinction(self) -> float:
        """Of the air on the ground, by all that is in it [1/m]."""
        return self.falls + (self.fog.extinction if self.fog is not None else 0.0)


@dataclass(frozen=True, slots=True)
class WeatherCourse:
    """The weather over time.

    All moments have the same kinds of things, such as fog, though perhaps of no density: what is
    compiled and built for a film hangs on the kinds alone.

    Attributes:
        times: Ascending, (n,) [s].
        moments: The weather at each of them.
    """

    times: tuple[float, ...]
    moments: tuple[Weather, ...]

    def __post_init__(self) -> None:
        """Refuse a course without moments, or with other kinds in some."""
        if len(self.times) != len(self.moments) or not self.moments:
            raise ValueError(f"{len(self.times)} times for {len(self.moments)} moments")
        if len({_kinds(moment) for moment in self.moments}) > 1:
            raise ValueError("moments of a course have the same kinds of weather")

    @property
    def changes(self) -> bool:
        """Whether it is not always the same."""
        return any(moment != self.moments[0] for moment in self.moments)

    @property
    def first(self) -> Weather:
        """The first moment's: it tells which kinds of weather there are."""
        return self.moments[0]

    @property
    def is_ever_murky(self) -> bool:
        """Whether drivers ever light their lamps by day."""
        return any(moment.is_murky for moment in self.moments)

    @property
    def is_ever_dense(self) -> bool:
        """Whether drivers ever light their rear fog lamps."""
        return any(moment.is_dense for moment in self.moments)

    @property
    def is_foggy(self) -> bool:
        """Whether something in the air ever takes light away."""
        return any(moment.extinction > 0.0 for moment in self.moments)

    @property
    def is_wet(self) -> bool:
        """Whether anything is ever wet."""
        return any(moment.wetness > 0.0 or moment.puddles > 0.0 for moment in self.moments)

    @property
    def strongest_wind(self) -> float:
        """The speed of its strongest wind [m/s]; 0 where none ever blows."""
        return max(0.0 if each.wind is None else each.wind.speed for each in self.moments)

    @property
    def is_seen(self) -> bool:
        """Whether it changes how light goes: more than a season and wind do."""
        return self.is_foggy or self.is_wet or self.is_snowy

    @property
    def rains(self) -> bool:
        """Whether it ever rains."""
        return self.has_falling("rain")

    @property
    def snows(self) -> bool:
        """Whether snow ever falls."""
        return self.has_falling("snow")

    def has_falling(self, name: str = "") -> bool:
        """Return whether some kind ever falls; without a name, whether any does."""
        rates = [moment.rates for moment in self.moments]
        return any(name in each if name else each for each in rates)

    @property
    def is_snowy(self) -> bool:
        """Whether snow ever lies."""
        return any(each.snow is not None and each.snow.depth > 0.0 for each in self.moments)

    def at(self, time: float) -> Weather:
        """Return the weather of a moment [s]: that of its neighbours, interpolated."""
        after = int(np.searchsorted(self.times, time, side="right"))
        if after == 0 or after == len(self.times):
            return self.moments[max(after - 1, 0)]
        start, end = self.times[after - 1], self.times[after]
        share = (time - start) / (end - start)
        return between(self.moments[after - 1], self.moments[after], share)


def between(earlier: Weather, later: Weather, share: float) -> Weather:
    """Return the weather between two others of the same kinds; words are the earlier's.

    Args:
        earlier: Where `share` is 0.
        later: Where it is 1.
        share: [0, 1].
    """
    if earlier == later:
        return earlier
    after = later.kinds
    kinds: dict[str, Any] = {
        name: kind.between(after[name], share) for name, kind in earlier.kinds.items()
    }
    return replace(
        earlier,
        wetness=_mixed(earlier.wetness, later.wetness, share),
        puddles=_mixed(earlier.puddles, later.puddles, share),
        **kinds,
    )


def _mixed(earlier: float, later: float, share: float) -> float:
    """Interpolate two numbers."""
    return earlier + (later - earlier) * share


def _kinds(weather: Weather) -> tuple[str, ...]:
    """Return what is in a weather at all."""
    return (*weather.kinds, weather.season)


_GROUND, _SNOWY = 0.2, 0.5
"""Reflectance of a landscape with houses and roads, without and with snow."""

_BURIED = 0.03
"""Depth of snow from which on it hides the ground [m]."""

_LEAST_FALL = 0.1
"""Rain or snow from which on the sky is closed [mm/h]."""

_THIN, _DEEPER = 30.0, 10.0
"""Optical depth of cloud that gives a drizzle, and how fast it grows with the rate [mm/h]."""

_LOWEST = 0.02
"""Sine of the lowest sun whose way through fog is told from the horizon's."""


def cover(weather: Weather) -> float:
    """Return the share of the sky that the clouds close which rain and snow fall from."""
    return min(1.0, _falling(weather) / _LEAST_FALL)


def cloud_depth(weather: Weather) -> float:
    """Return the optical depth of those clouds; by design, through Stephens's range."""
    return _THIN * math.pow(1.0 + _falling(weather) / _DEEPER, 0.8)


def passed(depth: float, sine: float) -> float:
    """Return the share of a beam's light that passes a layer, scattered or not.

    Args:
        depth: Optical depth of the layer.
        sine: Of the beam's elevation, in (0, 1].
    """
    # A share g^2 of what droplets scatter goes on as good as straight, as if not scattered.
    direct = straight((1.0 - ASYMMETRY**2) * depth, sine)
    above = (2.0 + 3.0 * sine) + (2.0 - 3.0 * sine) * direct
    return above / (4.0 + 3.0 * (1.0 - ASYMMETRY) * depth)


def passed_diffuse(depth: float) -> float:
    """Return the share of an even sky's light that passes a layer."""
    return 1.0 / (1.0 + 0.75 * (1.0 - ASYMMETRY) * depth)


def straight(depth: float, sine: float) -> float:
    """Return the share of the sun's beam that passes a layer without being scattered."""
    return math.exp(-min(depth / max(sine, _LOWEST), 700.0))


def echo(depth: float, weather: Weather) -> float:
    """Return the factor by which light grows that ground and layer send to and fro."""
    return 1.0 / (1.0 - ground(weather) * (1.0 - passed_diffuse(depth)))


def ground(weather: Weather) -> float:
    """Return the reflectance of the landscape."""
    snow = weather.snow or Snow()
    return _GROUND + (_SNOWY - _GROUND) * min(1.0, snow.depth / _BURIED)


def left(weather: Weather, sine: float) -> float:
    """Return the share of a clear day's light on the ground that clouds and fog leave.

    Args:
        weather: Of the moment.
        sine: Of the sun's elevation; suns below the horizon count as diffuse light.
    """
    share = 1.0
    hidden, fog = cover(weather), weather.fog
    if hidden > 0.0:
        depth = cloud_depth(weather)
        share = 1.0 - hidden + hidden * _through(depth, sine) * echo(depth, weather)
    if fog is not None:
        sine = sine if hidden < 1.0 else 0.0
        share *= _through(fog.overhead, sine) * echo(fog.overhead, weather)
    return share


def _through(depth: float, sine: float) -> float:
    """Share of light that passes a layer: a beam's, or a diffuse sky's where there is none."""
    return passed(depth, sine) if sine > 0.0 else passed_diffuse(depth)


def _falling(weather: Weather) -> float:
    """All that falls, as water [mm/h]."""
    return sum(weather.rates.values())


@dataclass(frozen=True, slots=True, eq=False)
class CloudLayer:
    """Clouds over the upper hemisphere, equirectangular.

    Rows go from the zenith to the horizon, columns clockwise from north seen
    from above (north, east, south, west).

    Attributes:
        cover: Opacity, (h, w) in [0, 1].
        sunlit: Share of the sun's irradiance that leaves as radiance x pi, (h, w).
        skylit: Share of the sky's irradiance that leaves as radiance x pi, (h, w).
        lit_from: Elevation of the sun that `sunlit` was made for [rad].
    """

    cover: Image
    sunlit: Image
    skylit: Image
    lit_from: float = float(np.pi / 4)

    @property
    def key(self) -> str:
        """A hash of all that it is."""
        whole = hashlib.blake2b(repr(self.lit_from).encode(), digest_size=16)
        for image in (self.cover, self.sunlit, self.skylit):
            whole.update(f"{image.shape}{image.dtype.str}".encode())
            whole.update(np.ascontiguousarray(image).data)
        return whole.hexdigest()


@dataclass(frozen=True, eq=False)
class StoredClouds:
    """A layer of clouds in a file, which is read when somebody first looks at it.

    Attributes:
        key: A hash of all that the layer is made from.
        lit_from: As in `CloudLayer`.
        read: Returns the layer.
    """

    key: str
    lit_from: float
    read: Callable[[], CloudLayer]

    @cached_property
    def layer(self) -> CloudLayer:
        """The layer itself."""
        return self.read()

    @property
    def cover(self) -> Image:
        """As in `CloudLayer`."""
        return self.layer.cover

    @property
    def sunlit(self) -> Image:
        """As in `CloudLayer`."""
        return self.layer.sunlit

    @property
    def skylit(self) -> Image:
        """As in `CloudLayer`."""
        return self.layer.skylit
