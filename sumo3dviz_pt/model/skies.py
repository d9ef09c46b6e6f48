"""What is above a scene, as the renderer is told of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Colour, Floats, Image, frozen


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


@dataclass(frozen=True, slots=True, eq=False)
class Sky:
    """The environment as a recipe; the renderer bakes it into one map.

    Attributes:
        sun_direction: Unit vector to the sun (east, north, up), or None for no sun.
        turbidity: Of the clear-sky model, [1, 10].
        clouds: A layer over the clear sky, or None.
        image: A user's radiance map instead of all this, (h, w, 3), rows from the
            zenith to the nadir, columns as in `CloudLayer`; or None.
        image_scale: Scene units per unit of `image`.
        rotation: Turns clouds and image clockwise seen from above [rad].
        night: Radiance of a moonless night sky, scene units; added everywhere.
        moon_direction: Unit vector to the full moon, or None; it gives no light beside
            the sun.
        stars: Seed of the stars, or None for none.
        glow: Radiance of a city's light at the horizon, scene units.
        tint: What the sun's light and sky are multiplied with.
        exposure: EV at which this sky looks right; the film's exposure adds to it.
        overcast: Clouds that rain or snow falls from at some time, or None.
    """

    sun_direction: Floats | None
    turbidity: float = 3.0
    clouds: CloudLayer | None = None
    image: Image | None = None
    image_scale: float = 1.0
    rotation: float = 0.0
    night: Colour = (0.0, 0.0, 0.0)
    moon_direction: Floats | None = None
    stars: int | None = None
    glow: Colour = (0.0, 0.0, 0.0)
    tint: Colour = (1.0, 1.0, 1.0)
    exposure: float = 0.0
    overcast: CloudLayer | None = None

    def __post_init__(self) -> None:
        """Make the directions unit vectors."""
        for name in ("sun_direction", "moon_direction"):
            given = getattr(self, name)
            if given is not None:
                direction = np.asarray(given, dtype=np.float64)
                object.__setattr__(self, name, frozen(direction / np.linalg.norm(direction)))


@dataclass(frozen=True, slots=True)
class Haze:
    """Aerial perspective: radiance x transmittance + in-scattered horizon light.

    Attributes:
        extinction: Per metre for red, green, blue [1/m].
        falls: Extinction of rain and snow that fall through it, where lamps light them [1/m].
    """

    extinction: Colour = (0.85 / 2600, 1.0 / 2600, 1.2 / 2600)
    falls: float = 0.0
