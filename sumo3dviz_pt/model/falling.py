"""What falls and flies before a camera while a frame is exposed: plain values of one frame.

A frame's picture is traced as if the air were empty; these values say what is laid over it when
it is finished. They are stored with the frame, so that it can be developed without its scene.
Places are in the network's coordinates; intensities in scene units x m^2.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Colour, Floats, Ints


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
