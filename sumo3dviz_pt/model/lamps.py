"""Lamps as a shot hands them to the renderer: on vehicles, and standing.

Radiances are in scene units, linear sRGB primaries.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Colour, Floats, Image, Ints, Mesh, frozen

CANDELAS_PER_UNIT = 32_000.0
"""Luminance of radiance 1 [cd/m^2]: a sunlit white wall has about 1."""

LENS_THAT_SHINES = 0.0
"""Reflectance of a vehicle's lamp while it shines: nothing else is as black, which tells it."""


@dataclass(frozen=True, slots=True)
class VehicleLamp:
    """A lamp on a body: a flat ellipse that shines away from it.

    Attributes:
        role: What lights it: `head`, `tail`, `brake`, `left`, `right`, `reverse`, `blue`,
            `sign`, and in a driver's own cabin `dials`, `screen`.
        at: Its centre in the body's frame, a few millimetres before the lens [m].
        size: Its width and height [m].
        yaw: Where it shines, from the body's +x [rad]: 0 forward, pi backward.
    """

    role: str
    at: tuple[float, float, float]
    size: tuple[float, float]
    yaw: float


@dataclass(frozen=True, slots=True)
class Lobe:
    """How radiance falls with the angle t from a lamp's axis: f + (1 - f) exp(-k (1 - cos t)).

    Attributes:
        floor: What is left far from the axis, f; 1 shines alike everywhere (Lambert's law), and
            more than 1 is brighter there, like luminaires that light a road evenly.
        sharpness: k; all above the floor has fallen to half where 1 - cos t = ln 2 / k.
    """

    floor: float = 1.0
    sharpness: float = 0.0

    def at(self, cosine: Floats) -> Floats:
        """Radiance against that on the axis, for cosines of angles from it."""
        return self.floor + (1.0 - self.floor) * np.exp(self.sharpness * (cosine - 1.0))

    @property
    def flux(self) -> float:
        """Of a small flat lamp that gives one candela on its axis [lm].

        The integral of `at` times the cosine over the half sphere; pi by Lambert's law.
        """
        k = max(self.sharpness, 1e-6)
        peak = 1.0 / k + np.expm1(-k) / k**2 if k > 1e-3 else 0.5
        return float(2.0 * np.pi * (0.5 * self.floor + (1.0 - self.floor) * peak))


@dataclass(frozen=True, slots=True, eq=False)
class LampSet:
    """Lamps that stand still, as one mesh; their radiance may change from frame to frame.

    Attributes:
        id: Unique, such as `signals`.
        family: As in `StaticPart`.
        mesh: All lenses, in world coordinates.
        lamp_of_face: Which lamp each face belongs to, (m,).
        lamps: Lamp names, such as `J1/3/green`.
        sampled: Whether light paths aim at them (night); in daylight they are
            only seen, which costs nothing.
        radiance: Of lamps that never change, (lamps, 3); None for those that a
            frame's state lights.
        weight: How often paths aim at this set, against others that give as much light.
        tint: Linear reflectance of each face's glass, (m, 3); None for dark grey.
        lobe: How they shine to the sides, where they are sampled.
    """

    id: str
    family: str
    mesh: Mesh
    lamp_of_face: Ints
    lamps: tuple[str, ...]
    sampled: bool = False
    radiance: Floats | None = None
    weight: float = 1.0
    tint: Floats | None = None
    lobe: Lobe = Lobe()

    def __post_init__(self) -> None:
        """Freeze the index."""
        object.__setattr__(self, "lamp_of_face", frozen(self.lamp_of_face, np.int64))


def aimed_at(lamps: Sequence[LampSet], *, dark: bool) -> tuple[LampSet, ...]:
    """Return lamps that change, with light paths that aim at them only when it is dark."""
    return tuple(replace(some, sampled=dark) if some.radiance is None else some for some in lamps)


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """What a vehicle's head lamps throw on the road.

    Attributes:
        pattern: Share of the peak, (n, n), rows from above to below, columns from left
            to right, straight ahead in the middle; even in the tangent of the angle.
        half_angle: From the middle to the pattern's edge [rad].
        intensity: Peak of both lamps of a car, scene units x m^2.
    """

    pattern: Image
    half_angle: float
    intensity: Colour


@dataclass(frozen=True, slots=True, eq=False)
class RunningLights:
    """Lamps on vehicles.

    Attributes:
        intensity: On the axis of one lamp by role, scene units x m^2; roles that are
            missing never shine.
        beam: Of head lamps, or None by day.
        sampled: As in `LampSet`.
        lobes: How lamps shine to the sides, by role; those missing by Lambert's law.
        heads: Share of a car's head lamps that other bodies have, by their names.
    """

    intensity: Mapping[str, Colour]
    beam: Beam | None = None
    sampled: bool = False
    lobes: Mapping[str, Lobe] = field(default_factory=dict)
    heads: Mapping[str, float] = field(default_factory=dict)
