"""What falls and flies before a camera: drops, flakes, puffs and wet panes, as plain values.

They are those of one frame while it is exposed. A frame's picture is traced as if the air were
empty; these values say what is laid over it when it is finished. They are stored with the frame, so
that it can be developed without its scene. Places are in the network's coordinates; intensities in
scene units x m^2.

Drops and flakes are given by how many there are of each size, and how fast they fall. Numbers are
per cubic metre and millimetre of diameter; a snowflake's size is that of the drop that it melts to,
from which the size of the flake follows.

A pane of glass before the eye reflects what lies under it. It is thin and plane, and takes no light
away: what it does not let through it reflects. A picture through it is that share of what lies
behind, and the rest of what its mirror image shows.

References:
    Marshall, J. S. and Palmer, W. M., The distribution of raindrops with size, Journal of
    Meteorology 5, 1948: 8000 exp(-4.1 R^-0.21 D) drops per m^3 and mm.
    Atlas, D., Srivastava, R. C. and Sekhon, R. S., Doppler radar characteristics of
    precipitation at vertical incidence, Reviews of Geophysics 11, 1973: 9.65 - 10.3 exp(-0.6 D)
    m/s, fitted to what Gunn and Kinzer measured, Journal of Meteorology 6, 1949.
    Gunn, K. L. S. and Marshall, J. S., The distribution with size of aggregate snowflakes,
    Journal of Meteorology 15, 1958: 3800 R^-0.87 exp(-2.55 R^-0.48 D).
    Langleben, M. P., The terminal velocity of snowflakes, Quarterly Journal of the Royal
    Meteorological Society 80, 1954: 1.6 (D / 1 cm)^0.3 m/s.
    Holroyd, E. W., The meso- and microscale structure of Great Lakes snowstorm bands, 1971:
    aggregates have a density of .17 g/cm^3 divided by their diameter in millimetres.
    Born and Wolf, "Principles of Optics", 7th edition, 1.5.2 (Fresnel's formulas) and 1.6.4 (both
    faces of a plate whose reflections do not interfere: 2 R / (1 + R)).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Colour, Floats, Image, Ints, Transform

_WATER, _FLAKE = 1.0, 0.17  # densities [g/cm^3]; a flake's is divided by its diameter in mm


@dataclass(frozen=True, slots=True)
class Sizes:
    """An exponential distribution of sizes.

    Attributes:
        most: Number of the smallest, per cubic metre and millimetre.
        slope: By which numbers fall [1/mm].
    """

    most: float
    slope: float

    def above(self, diameter: Floats | float) -> Floats:
        """How many are larger than a diameter [mm], per cubic metre."""
        return np.asarray(self.most / self.slope * np.exp(-self.slope * np.asarray(diameter)))

    def share_at(self, share: Floats, low: Floats | float, high: Floats | float) -> Floats:
        """Diameters between two others [mm], spread as this distribution is.

        Args:
            share: Of those between that are smaller, [0, 1].
            low: The least diameter [mm].
            high: The largest [mm].
        """
        share_below = -np.expm1(-self.slope * (np.asarray(high) - low))
        return np.asarray(low - np.log1p(-share * share_below) / self.slope)


def rain_sizes(rate: float) -> Sizes:
    """Return the drops of a rain, by the diameter of the drop.

    Args:
        rate: More than 0 [mm/h].
    """
    return Sizes(8000.0, 4.1 * rate**-0.21)


def snow_sizes(rate: float) -> Sizes:
    """Return the flakes of a snowfall, by the diameter of the drop that each melts to.

    Args:
        rate: As water, more than 0 [mm/h].
    """
    return Sizes(3800.0 * rate**-0.87, 2.55 * rate**-0.48)


def drop_speed(diameter: Floats | float) -> Floats:
    """Return how fast drops of a diameter [mm] fall in still air [m/s]."""
    return np.asarray(np.maximum(9.65 - 10.3 * np.exp(-0.6 * np.asarray(diameter)), 0.1))


def flake_speed(melted: Floats | float) -> Floats:
    """Return how fast flakes fall, by the diameter that they melt to [mm], in still air [m/s]."""
    return np.asarray(1.6 * (np.asarray(melted) / 10.0) ** 0.3)


def flake_diameter(melted: Floats | float) -> Floats:
    """Return the diameter of flakes [mm], by that of the drop that each melts to [mm]."""
    # Equal mass: water x melted^3 = (.17 / diameter) x diameter^3.
    return np.asarray(np.sqrt(_WATER / _FLAKE * np.asarray(melted) ** 3))


GLASS = 1.52
"""Index of refraction of soda-lime glass."""

_EDGE = 0.04
"""Within this of its edges a pane fades, so that none of them shows [m]."""


_STEEPEST = 1e-6
"""Rays that run along a pane by less than this as a slope meet it nowhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Pane:
    """A plane pane.

    Attributes:
        world_from_pane: Its placement: +x across to the left, +y up along the glass; its origin is
            the middle of its lower edge [m].
        size: Width and height [m].
    """

    world_from_pane: Transform
    size: tuple[float, float]


def reflectance(cosine: Floats) -> Floats:
    """Return the share of unpolarised light that a thin pane reflects, (n,) in [0, 1].

    Args:
        cosine: Between the light and the pane's normal, (n,) in [0, 1].
    """
    within = np.sqrt(1.0 - (1.0 - cosine**2) / GLASS**2)
    across = (cosine - GLASS * within) / (cosine + GLASS * within)
    along = (within - GLASS * cosine) / (within + GLASS * cosine)
    one_face = 0.5 * (across**2 + along**2)
    return np.asarray(2.0 * one_face / (1.0 + one_face))


def reflection_samples(samples: int) -> int:
    """Return the samples of a pixel's reflection, by those of the picture behind the pane.

    A quarter is enough of what is a tenth as bright.
    """
    return max(2, samples // 4)


def reflected_share(pane: Pane, eye: Floats, directions: Floats, distance: Image) -> Image:
    """Return how much of each pixel is what a pane reflects, (h, w) in [0, 1].

    Args:
        pane: Before the eye.
        eye: Where that is, (3,) [m].
        directions: Unit, through the pixels' centres, (h, w, 3).
        distance: Of what is seen, (h, w) [m]; what is nearer than the pane hides it.
    """
    frame = pane.world_from_pane.matrix
    left, up, ahead = frame[:3, :3].T
    slope = directions @ ahead
    steep = np.where(np.abs(slope) > _STEEPEST, slope, np.inf)
    away = float((frame[:3, 3] - eye) @ ahead) / steep
    met = eye + directions * away[..., None] - frame[:3, 3]
    height = pane.size[1]
    inside = 0.5 * np.array(pane.size) - np.abs(
        np.stack([met @ left, met @ up - 0.5 * height], axis=-1)
    )
    cover = np.clip(inside.min(axis=-1) / _EDGE, 0.0, 1.0) * (away > 0.0) * (distance > away)
    return np.asarray(cover * reflectance(np.clip(np.abs(slope), 0.0, 1.0)), np.float32)


@dataclass(frozen=True, slots=True)
class SkyLight:
    """Even light from above, and the sun's.

    Attributes:
        sky: Mean radiance of the dome, as the ground sees it: irradiance / pi.
        sun: Irradiance facing the sun.
        towards: Unit vector to the sun.
    """

    sky: Colour
    sun: Colour = (0.0, 0.0, 0.0)
    towards: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Glows:
    """Lamps that shine on what falls, as points.

    Attributes:
        at: (n, 3) [m].
        axes: Unit vectors in whose direction they shine, (n, 3).
        intensity: On the axis, (n, 3).
        lobes: How it falls to the sides: floor and sharpness of `lamps.Lobe`, (n, 2).
    """

    at: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    axes: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    intensity: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    lobes: Floats = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, slots=True, eq=False)
class Throws:
    """What head lamps throw ahead.

    Attributes:
        frames: Placements of the lamps, +x ahead and +z up, (n, 4, 4) [m].
        intensity: Peaks, (n, 3).
        pattern: Share of the peak, as in `lamps.Beam`, (k, k).
        edge: Tangent of the angle from the middle to the pattern's edge.
    """

    frames: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))
    intensity: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    pattern: Floats = field(default_factory=lambda: np.ones((1, 1)))
    edge: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Puffs:
    """Balls of spray behind tyres, denser in the middle.

    Attributes:
        at: Their middles, (n, 3) [m].
        radii: Where their density has fallen to exp(-1/2), (n,) [m].
        depths: Optical depth through the middle of each, (n,).
    """

    at: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    radii: Floats = field(default_factory=lambda: np.zeros(0))
    depths: Floats = field(default_factory=lambda: np.zeros(0))

    def only(self, which: Ints) -> Puffs:
        """Return some of them."""
        return Puffs(self.at[which], self.radii[which], self.depths[which])


@dataclass(frozen=True, slots=True, eq=False)
class Cabin:
    """The vehicle around a camera; nothing falls in it.

    Attributes:
        world_from_body: Its placement, +x forward, origin on the ground below the front's
            middle, (4, 4) [m].
        size: Length, width and height, (3,) [m].
    """

    world_from_body: Floats
    size: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Windscreen:
    """A pane of glass before the eye, with drops and wipers on it.

    Attributes:
        camera_from_pane: Placement of the pane: +x across to the left, +y up along the glass, +z
            towards the road; its origin is the middle of its lower edge, (4, 4) [m].
        size: Width and height [m].
        pivots: Where the wipers turn, (n, 2) [m].
        reach: Lengths from the pivot between which a blade wipes, (2,) [m].
        wiped: Turns of the wipers since the film's clock began.
        period: Time of one turn at this rate [s].
        wet: How fast drops settle, per square metre and second.
    """

    camera_from_pane: Floats
    size: tuple[float, float]
    pivots: Floats
    reach: tuple[float, float]
    wiped: float
    period: float
    wet: float


@dataclass(frozen=True, slots=True, eq=False)
class Falling:
    """What falls and flies before a camera while a frame is exposed.

    Attributes:
        time: Middle of the exposure [s].
        exposure: Its length [s].
        seed: The scene's.
        cameras: World from camera when the shutter opens and when it closes, (2, 4, 4).
        rain: [mm/h].
        strength: How many times as much of a pixel a drop covers as it should.
        snow: As water [mm/h].
        wind: Towards the east and the north, (2,) [m/s].
        drift: How far wind has carried since time 0, (2,) [m].
        fog: Extinction of the air near the camera by fog [1/m].
        wetness: Of what lies under the sky, [0, 1].
        aperture: Diameter of the lens's entrance pupil [m].
        focus: Distance of what is sharp [m]; infinite is far away.
        ground: Share of light that the ground reflects, [0, 1].
        glows: Lamps that shine on it.
        throws: Head lamps.
        puffs: Spray behind tyres.
        cabin: Where nothing falls, or None.
        windscreen: Before the eye, or None.
        rolling: How much later the picture's last row is seen than its first [s].
    """

    time: float
    exposure: float
    seed: int
    cameras: Floats
    rain: float = 0.0
    snow: float = 0.0
    wind: tuple[float, float] = (0.0, 0.0)
    drift: tuple[float, float] = (0.0, 0.0)
    fog: float = 0.0
    wetness: float = 0.0
    strength: float = 1.0
    aperture: float = 0.0
    focus: float = float("inf")
    ground: float = 0.12
    glows: Glows = field(default_factory=Glows)
    throws: Throws = field(default_factory=Throws)
    puffs: Puffs = field(default_factory=Puffs)
    cabin: Cabin | None = None
    windscreen: Windscreen | None = None
    rolling: float = 0.0
