"""How much daylight weather lets through: clouds that rain and snow fall from, and fog.

A layer of droplets takes hardly any light, but sends much of it back up. What passes is the
two-stream answer for light that is scattered and never absorbed; light that the ground sends up is
partly sent down again, so snow makes dull days brighter.

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
"""

from __future__ import annotations

import math

from sumo3dviz_pt.model.weather import ASYMMETRY, Snow, Weather

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
    """Rain and snow together, as water [mm/h]."""
    rain = 0.0 if weather.rain is None else weather.rain.rate
    return rain + (0.0 if weather.snow is None else weather.snow.falling)
