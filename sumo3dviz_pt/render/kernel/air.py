"""What rays may meet, and what the air between takes away and adds.

Rays meet one scene of Mitsuba's, or what moves and what stands apart. Mitsuba builds the tree of a
scene anew when anything in it has moved. Where what stands has a scene of its own, its tree is
built once, and rays ask both.

The air takes light away and adds its own, in closed form for every segment of a path. The density
of fog is even up to a height and falls exponentially above it; rain and snow that fall are the same
at all heights. Light from the air itself is that of the fog's own sky (see
`render/sky/weathered.py`), so things that fade meet the horizon behind them. Sky and sun are given
as they reach the ground, through all that lies above: paths to them lose nothing here.

References:
    Koschmieder, H., Theorie der horizontalen Sichtweite, Beitraege zur Physik der freien
    Atmosphaere 12, 1924 (contrast falls as exp(-extinction x distance)).
    Quilez, I., Better fog, https://iquilezles.org/articles/fog, 2010 (exponential heights).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.weather import ASYMMETRY, Weather
from sumo3dviz_pt.render.backend import check_scenes
from sumo3dviz_pt.render.loaded import LoadedScene


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """All that rays may meet.

    Attributes:
        scene: Mitsuba's, of everything or of what moves.
        standing: Mitsuba's, of what stands; None where the other one holds that, too.
    """

    scene: Any
    standing: Any = None

    def __post_init__(self) -> None:
        """Refuse two scenes where a kernel may ask only one."""
        check_scenes(mi.variant(), 1 if self.standing is None else 2)

    def nearest(self, ray: Any, coherent: Any, active: Any = True) -> Any:
        """Return what a ray meets first, as Mitsuba's preliminary intersection.

        Args:
            ray: The ray.
            coherent: Whether neighbouring rays run alike.
            active: Which lanes count.
        """
        if self.standing is None:
            return self.scene.ray_intersect_preliminary(ray, coherent, active=active)
        stands = self.standing.ray_intersect_preliminary(ray, coherent, active=active)
        shorter = mi.Ray3f(ray)
        # The distance is inf where nothing stands. Where both are in one place, chance decided
        # in one scene; here it is what moves.
        shorter.maxt = dr.minimum(ray.maxt, stands.t)
        moves = self.scene.ray_intersect_preliminary(shorter, coherent, active=active)
        return dr.select(moves.is_valid(), moves, stands)

    def hide(self, ray: Any, active: Any) -> Any:
        """Return whether anything is in the way of a ray.

        Args:
            ray: It ends at its `maxt`.
            active: Which lanes count.
        """
        if self.standing is None:
            return self.scene.ray_test(ray, active)
        hidden = self.standing.ray_test(ray, active)
        return hidden | self.scene.ray_test(ray, active & ~hidden)


_LEVEL = 0.05
"""Rise along a segment below which its density counts as that of its middle [m]."""

_HIGHEST = 1e4
"""Height in which density falls that counts as even [m]."""


class Air:
    """The air of a frame, as numbers that are no part of the kernel's code.

    Args:
        loaded: A scene that shows a frame.
    """

    def __init__(self, loaded: LoadedScene) -> None:
        self._loaded = loaded
        self.follow()

    def follow(self) -> None:
        """Bring the air to the frame that is shown."""
        frame, veil = self._loaded.frame, self._loaded.veil
        assert frame is not None and frame.weather is not None and veil is not None
        even, dense, height, base = _extinctions(frame.weather)
        self._even, self._dense, self._height, self._base = (
            dr.opaque(mi.Float, number)
            for number in (even, dense, height, base - float(frame.origin[2]))
        )
        self._diffuse = dr.opaque(mi.Color3f, list(veil.diffuse))
        self._direct = dr.opaque(mi.Color3f, list(veil.direct))
        self._sun = dr.opaque(mi.Vector3f, list(veil.towards))

    def depth(self, start: Any, d: Any, distance: Any) -> Any:
        """Return the optical depth of segments.

        Args:
            start: Where they start, points.
            d: Unit directions.
            distance: Their lengths [m].
        """
        low = start.z - self._base
        rise = d.z * distance
        level = dr.abs(rise) < _LEVEL
        risen = dr.select(level, 1.0, rise)
        mean = (self._column(low + rise) - self._column(low)) / risen
        mean = dr.select(level, self._density(low + 0.5 * rise), mean)
        return (self._even + self._dense * mean) * distance

    def through(self, start: Any, d: Any, distance: Any, active: Any) -> Any:
        """Return the share of light that passes segments; all of it where lanes do not count."""
        length = dr.select(active, distance, 0.0)
        return dr.exp(-self.depth(start, d, length))

    def reach(self, start: Any, d: Any, distance: Any, active: Any) -> Any:
        """Return the share of a lamp's light that reaches a place through segments.

        A share g^2 of what droplets scatter goes on as good as straight (delta scaling, see
        `model/weather.py`): it is lost for the lamp's image, but still lights things there.
        """
        length = dr.select(active, distance, 0.0)
        return dr.exp((ASYMMETRY**2 - 1.0) * self.depth(start, d, length))

    def extinction(self, place: Any) -> Any:
        """Return the extinction at points [1/m]."""
        return self._even + self._dense * self._density(place.z - self._base)

    def light(self, d: Any) -> Any:
        """Return the radiance of so much air that nothing is seen through it.

        Args:
            d: Unit directions of view.
        """
        return self._diffuse + self._direct * phase(dr.dot(d, self._sun))

    def _density(self, height: Any) -> Any:
        """Density of the fog at heights above its base, against that below."""
        return dr.exp(-dr.maximum(height, 0.0) / self._height)

    def _column(self, height: Any) -> Any:
        """Fog between its base and heights, in metres of its density there."""
        above = self._height * (1.0 - dr.exp(-dr.maximum(height, 0.0) / self._height))
        return dr.minimum(height, 0.0) + above


def phase(cosine: Any) -> Any:
    """Return how droplets scatter by the cosine of the angle (Henyey and Greenstein) [1/sr]."""
    g = ASYMMETRY
    below = 1.0 + g * g - 2.0 * g * cosine
    return (1.0 - g * g) / (4.0 * np.pi) * dr.rcp(below * dr.sqrt(below))


def _extinctions(weather: Weather) -> tuple[float, float, float, float]:
    """Return extinction at all heights, that of layered fog, and its height and base."""
    fog = weather.fog
    if fog is None:
        return weather.falls, 0.0, _HIGHEST, 0.0
    if fog.height > _HIGHEST:
        return weather.falls + fog.extinction, 0.0, _HIGHEST, fog.base
    return weather.falls, fog.extinction, fog.height, fog.base
