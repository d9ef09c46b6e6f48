"""The clear sky around sunrise and sunset: sunlight scattered in a round atmosphere.

Molecules, aerosol and ozone filter the light at ten wavelengths. The first scattering is traced
along every ray, all later ones are isotropic. What follows from it: the warm band under the blue
hour (ozone), the Earth's shadow with its pink belt, the glow around a low sun, and clouds that
still see the sun. Three wavelengths are too few: their dusk is purple.

References:
    S. Hillaire, A scalable and production ready sky and atmosphere rendering technique,
    Computer Graphics Forum 39(4), 2020, doi:10.1111/cgf.14050 (molecules, heights, later
    scatterings in section 5.5).
    V. Gorshelev et al., High spectral resolution ozone absorption cross-sections, Atmos.
    Meas. Tech. 7, 2014, doi:10.5194/amt-7-609-2014 (Chappuis band, rounded).
    A. J. Preetham et al., A practical analytic model for daylight, SIGGRAPH 1999 (turbidity:
    optical depth of all air over that of its molecules; Angstrom's exponent 1.3).
    C. Wyman, P.-P. Sloan, P. Shirley, Simple analytic approximations to the CIE XYZ color
    matching functions, JCGT 2(2), 2013.
    IAU 2015 resolution B3 (the sun's effective temperature, 5772 K).
    IEC 61966-2-1 (sRGB primaries).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats

WAVELENGTHS = np.arange(415.0, 700.0, 30.0)
"""Wavelengths at which light is computed: middles of ten bands of 400 to 700 nm, (10,)."""

_XYZ_TO_SRGB = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
_SOLAR_KELVIN = 5772.0
_LEAST = 0.02  # of the strongest primary: sRGB cannot show purer colours


def _lobe(peak: float, below: float, above: float) -> Floats:
    """Return a Gaussian with two widths [nm], (10,)."""
    width = np.where(peak > WAVELENGTHS, below, above)
    return np.asarray(np.exp(-0.5 * ((WAVELENGTHS - peak) / width) ** 2))


def _observer() -> Floats:
    """Return the CIE 1931 observer's x, y, z at the wavelengths, (10, 3)."""
    x = 1.056 * _lobe(599.8, 37.9, 31.0) + 0.362 * _lobe(442.0, 16.0, 26.7)
    x = x - 0.065 * _lobe(501.1, 20.4, 26.2)
    y = 0.821 * _lobe(568.8, 46.9, 40.5) + 0.286 * _lobe(530.9, 16.3, 31.1)
    z = 1.217 * _lobe(437.0, 11.8, 36.0) + 0.681 * _lobe(459.0, 26.0, 13.8)
    return np.stack([x, y, z], axis=-1)


def _spectrum_sunlight() -> Floats:
    """Return the sun's spectrum by Planck's law, relative, (10,)."""
    metres = WAVELENGTHS * 1e-9
    return np.asarray(metres**-5.0 / np.expm1(1.4387769e-2 / (metres * _SOLAR_KELVIN)))


def _matrix() -> Floats:
    """Return linear sRGB of sunlight in each band, (10, 3); their sum is white."""
    bands = (_observer() * _spectrum_sunlight()[:, None]) @ _XYZ_TO_SRGB.T
    return np.asarray(bands / bands.sum(axis=0))


_BANDS = _matrix()


def to_rgb(share: Floats) -> Floats:
    """Return linear sRGB of sunlight of which a share is left at each wavelength.

    Args:
        share: Of the sun's light outside the air, (..., 10).

    Returns:
        (..., 3); 1 where all is left. Colours outside the primaries' triangle are brought
        to its edge.
    """
    rgb = share @ _BANDS
    return np.asarray(np.maximum(rgb, _LEAST * rgb.max(axis=-1, keepdims=True)))


_EARTH, _TOP = 6_360e3, 6_460e3
_EYE = 200.0
_MOLECULES = 13.558e-6 * (550.0 / WAVELENGTHS) ** 4
_AEROSOL = (WAVELENGTHS / 550.0) ** -1.3
_AEROSOL_SCATTERS = 0.95  # share that is scattered of what aerosol takes out of a ray
# Cross-sections of ozone [1e-21 cm^2]; there are 300 Dobson units of it, around a height of 25 km.
_CHAPPUIS = np.array([0.03, 0.14, 0.39, 1.25, 2.55, 4.25, 5.0, 3.9, 2.3, 1.25])
_OZONE = _CHAPPUIS * 8.07e18 * 1e-21 / 15e3
_FORWARD = 0.8  # asymmetry of the aerosol's phase function
_AEROSOL_HEIGHT = 1.2e3
_DISC = np.radians(0.5)  # softens the Earth's shadow

_HEIGHTS = np.array([0.0, 1e3, 3e3, 6e3, 11e3, 18e3, 28e3, 42e3, 65e3])
_SUNS = np.radians(np.arange(-24.0, 17.0, 1.25))


@dataclass(frozen=True, slots=True, eq=False)
class ClearDome:
    """Radiance of the clear sky, coarse; the sun stands at azimuth 0.

    Attributes:
        elevation: Of the rows, rising from the horizon to the zenith, (n,) [rad].
        azimuth: Of the columns, from the sun, rising from 0 to pi, (m,) [rad].
        radiance: Per unit of irradiance outside the atmosphere, (n, m, 3).
    """

    elevation: Floats
    azimuth: Floats
    radiance: Floats

    def towards(self, elevation: Floats, azimuth: Floats) -> Floats:
        """Return the radiance at elevations, (a,), and azimuths from the sun, (b,): (a, b, 3)."""
        rows = _blend(self.elevation, elevation)
        folded = np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi)
        columns = _blend(self.azimuth, folded)
        radiance = np.einsum("an,nmc,bm->abc", rows, self.radiance, columns, optimize=True)
        return np.asarray(radiance)


def _blend(known: Floats, wanted: Floats) -> Floats:
    """Return weights that interpolate linearly, (asked, known)."""
    right = np.clip(np.searchsorted(known, wanted), 1, len(known) - 1)
    share = np.clip((wanted - known[right - 1]) / (known[right] - known[right - 1]), 0.0, 1.0)
    weights = np.zeros((len(wanted), len(known)))
    each = np.arange(len(wanted))
    weights[each, right - 1], weights[each, right] = 1.0 - share, share
    return weights


class _Air(NamedTuple):
    """How much of each part of the air there is, against where its coefficient holds.

    Attributes:
        molecules: Against the ground.
        aerosol: Against the ground.
        ozone: Against a height of 25 km.
    """

    molecules: Floats
    aerosol: Floats
    ozone: Floats


def _densities(height: Floats) -> _Air:
    """Return the air at heights [m]; its parts have the heights' shape."""
    height = np.maximum(height, -500.0)
    ozone = np.maximum(0.0, 1.0 - np.abs(height - 25e3) / 15e3)
    return _Air(np.exp(-height / 8e3), np.exp(-height / _AEROSOL_HEIGHT), ozone)


def _aerosol(turbidity: float) -> Floats:
    """Return the extinction of the aerosol on the ground at each wavelength, (10,) [1/m]."""
    molecules = 8e3 * 13.558e-6  # their optical depth at 550 nm
    return np.asarray((turbidity - 1.0) * molecules / _AEROSOL_HEIGHT * _AEROSOL)


def _extinction(height: Floats, haze: Floats) -> Floats:
    """Return the extinction, (..., 10) [1/m]; `haze` comes from `_aerosol`."""
    molecules, aerosol, ozone = (part[..., None] for part in _densities(height))
    return np.asarray(molecules * _MOLECULES + aerosol * haze + ozone * _OZONE)


def _to_top(radius: Floats, sine: Floats) -> Floats:
    """Return the way to the top of the air along rays, by the sine of their elevation [m]."""
    inside = np.maximum(radius**2 * (sine**2 - 1.0) + _TOP**2, 0.0)
    return np.maximum(np.sqrt(inside) - radius * sine, 1.0)


def sunlight(height: Floats, sine: Floats, turbidity: float = 3.0) -> Floats:
    """Return the colour of the sunlight that is left, (..., 3); (1, 1, 1) outside the air.

    Args:
        height: Above the ground [m].
        sine: Of the sun's local elevation.
        turbidity: Of the air, [1, 10].
    """
    return to_rgb(_sunlight(height, sine, _aerosol(turbidity)))


def _sunlight(height: Floats, sine: Floats, haze: Floats) -> Floats:
    """Return the share of sunlight left at each wavelength, (..., 10)."""
    radius, steps = _EARTH + height, 24
    way = _to_top(radius, sine)
    # Rays that go down have their densest air in the middle, others at their start.
    place = (np.arange(steps) + 0.5) / steps
    place = np.where(sine[..., None] < 0.0, place, place**2)
    weight = np.where(sine[..., None] < 0.0, 1.0, 2.0 * np.sqrt(place)) / steps
    along = place * way[..., None]
    high = np.sqrt(radius[..., None] ** 2 + along**2 + 2.0 * along * (radius * sine)[..., None])
    each = _densities(high - _EARTH)
    molecules, aerosol, ozone = (((part * weight).sum(-1) * way)[..., None] for part in each)
    depth = molecules * _MOLECULES + aerosol * haze + ozone * _OZONE
    dip = np.arccos(np.minimum(_EARTH / radius, 1.0))
    over = (np.arcsin(np.clip(sine, -1.0, 1.0)) + dip) / _DISC
    seen = np.clip(0.5 + 0.5 * over, 0.0, 1.0)[..., None]
    return np.asarray(np.exp(-depth) * seen)


def _phases(cosine: Floats) -> tuple[Floats, Floats]:
    """Return the phase functions of molecules and aerosol (Cornette and Shanks) [1/sr]."""
    molecules = 3.0 / (16.0 * np.pi) * (1.0 + cosine**2)
    g = _FORWARD
    aerosol = 3.0 / (8.0 * np.pi) * (1.0 - g * g) / (2.0 + g * g) * (1.0 + cosine**2)
    return molecules, aerosol / (1.0 + g * g - 2.0 * g * cosine) ** 1.5


@dataclass(frozen=True, slots=True, eq=False)
class _March:
    """Samples along rays from one height each; axes (rays, steps).

    Attributes:
        height: Above the ground [m].
        sun: Sine of the sun's local elevation.
        weight: Share that scattering at the sample leaves at the ray's start x length [m].
    """

    height: Floats
    sun: Floats
    weight: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Rays:
    """Rays to walk, axes (n,).

    Attributes:
        start: Height of their start [m].
        up: Sine of their elevation there.
        sun: Sine of the sun's elevation there.
        cosine: Of the angle between ray and sun.
    """

    start: Floats
    up: Floats
    sun: Floats
    cosine: Floats


def _march(rays: _Rays, haze: Floats, steps: int) -> _March:
    """Walk rays through the air with a number of samples."""
    radius, ray, sun, cosine = _EARTH + rays.start, rays.up, rays.sun, rays.cosine
    ground = radius**2 * (ray**2 - 1.0) + _EARTH**2
    falls = (ray < 0.0) & (ground > 0.0)
    way = np.where(falls, -radius * ray - np.sqrt(np.maximum(ground, 0.0)), _to_top(radius, ray))
    edges = (np.arange(steps + 1) / steps) ** 2
    along = way[:, None] * (0.5 * (edges[1:] + edges[:-1]))
    length = way[:, None] * np.diff(edges)
    high = np.sqrt(radius[:, None] ** 2 + along**2 + 2.0 * along * (radius * ray)[:, None])
    local = ((radius * sun)[:, None] + along * cosine[:, None]) / high
    taken = _extinction(high - _EARTH, haze) * length[..., None]
    through = np.exp(-(np.cumsum(taken, axis=1) - taken))
    # The integral over a step of constant extinction (Hillaire 2015).
    inside = length[..., None] * -np.expm1(-taken) / np.maximum(taken, 1e-12)
    return _March(high - _EARTH, local, through * inside)


def _first(march: _March, cosine: Floats, haze: Floats) -> tuple[Floats, Floats]:
    """Return light scattered once per metre, and scattering itself, (rays, steps, 10) each."""
    air = _densities(march.height)
    molecules = air.molecules[..., None] * _MOLECULES
    aerosol = air.aerosol[..., None] * (_AEROSOL_SCATTERS * haze)
    by_molecules, by_aerosol = (phase[:, None, None] for phase in _phases(cosine))
    light = _sunlight(march.height, march.sun, haze)
    return (molecules * by_molecules + aerosol * by_aerosol) * light, molecules + aerosol


def _later(haze: Floats) -> Floats:
    """Return what all later scatterings bring to a point, (heights, suns, 10) [1/sr]."""
    sine = np.linspace(-0.9, 0.9, 7)
    around = (np.arange(4) + 0.5) / 4 * np.pi
    ray, turn = (part.ravel() for part in np.meshgrid(sine, around, indexing="ij"))
    height, sun = (part.ravel() for part in np.meshgrid(_HEIGHTS, np.sin(_SUNS), indexing="ij"))
    rays, points = len(ray), len(height)
    height, sun = np.repeat(height, rays), np.repeat(sun, rays)
    ray, turn = np.tile(ray, points), np.tile(turn, points)
    cosine = ray * sun + np.sqrt((1.0 - ray**2) * (1.0 - sun**2)) * np.cos(turn)
    march = _march(_Rays(height, ray, sun, cosine), haze, 10)
    light, scatters = _first(march, cosine, haze)
    second = (light * march.weight).sum(1).reshape(points, rays, -1).mean(1)
    again = (scatters * march.weight).sum(1).reshape(points, rays, -1).mean(1)
    return np.asarray(second / (1.0 - again)).reshape(len(_HEIGHTS), len(_SUNS), -1)


def _look_up(table: Floats, height: Floats, sun: Floats) -> Floats:
    """Interpolate `_later` at heights and sines of the sun's elevation, (..., 10)."""
    row = np.interp(height, _HEIGHTS, np.arange(len(_HEIGHTS)))
    place = np.interp(np.arcsin(np.clip(sun, -1.0, 1.0)), _SUNS, np.arange(len(_SUNS)))
    top = np.minimum(row.astype(np.intp), len(_HEIGHTS) - 2)
    left = np.minimum(place.astype(np.intp), len(_SUNS) - 2)
    down, right = (row - top)[..., None], (place - left)[..., None]

    def at(i: NDArray[np.intp], j: NDArray[np.intp]) -> Floats:
        return np.asarray(table[i, j])

    upper = at(top, left) * (1 - right) + at(top, left + 1) * right
    lower = at(top + 1, left) * (1 - right) + at(top + 1, left + 1) * right
    return np.asarray(upper * (1 - down) + lower * down)


def clear_dome(
    elevation: float, turbidity: float = 3.0, *, rows: int = 44, columns: int = 26
) -> ClearDome:
    """Compute the radiance of the clear sky for a low sun.

    Args:
        elevation: Of the sun [rad]; below -16 degrees as at -16, above 14 as at 14.
        turbidity: Of the air, [1, 10].
        rows: Directions from the horizon to the zenith, denser near the horizon.
        columns: Directions from the sun's azimuth to the opposite, denser near the sun.
    """
    sine = float(np.sin(np.clip(elevation, np.radians(-16.0), np.radians(14.0))))
    high = np.radians(0.25 + 89.75 * np.linspace(0.0, 1.0, rows) ** 2)
    around = np.pi * np.linspace(0.0, 1.0, columns) ** 1.7
    up, turn = (part.ravel() for part in np.meshgrid(high, around, indexing="ij"))
    cosine = np.sin(up) * sine + np.cos(up) * np.sqrt(1.0 - sine**2) * np.cos(turn)
    haze = _aerosol(turbidity)
    rays = _Rays(np.full(up.size, _EYE), np.sin(up), np.full(up.size, sine), cosine)
    march = _march(rays, haze, 36)
    light, scatters = _first(march, cosine, haze)
    light = light + scatters * _look_up(_later(haze), march.height, march.sun)
    radiance = to_rgb((light * march.weight).sum(1))
    return ClearDome(high, around, radiance.reshape(rows, columns, 3))
