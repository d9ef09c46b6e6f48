"""The shell of a heavy vehicle as a field, and its mesh.

Coordinates are d (behind the front), y and z in metres; a shell is symmetric in y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bakery.halves import half_surface
from bakery.heavy.recipe import Hull
from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import ProfileCurve, intersect
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Floats

_MARGIN = 0.06  # of the grid around a shell [m]
_STEEPEST = 4.0  # slopes of outlines count no more than this
_ENDS = 1.3  # length of the finer grid at either end [m]
_COARSER = 2.0  # spacing between the ends, in spacings at the ends


@dataclass(frozen=True, slots=True, eq=False)
class Shell:
    """A shell with its splines made ready.

    Attributes:
        hull: Where it comes from.
        nose: Front outline over z.
        tail: Rear outline over z.
        top: Roof over d.
        bottom: Floor over d.
        section: Half width over z, as a share of the largest.
        plan: Half width over d, as a share of the largest.
    """

    hull: Hull
    nose: ProfileCurve
    tail: ProfileCurve
    top: ProfileCurve
    bottom: ProfileCurve
    section: ProfileCurve
    plan: ProfileCurve

    def field(self, d: Floats, y: Floats, z: Floats) -> Floats:
        """Return the shell's field: negative inside.

        Args:
            d: Distance behind the front [m].
            y: To the left, of the same shape [m].
            z: Height, of the same shape [m].
        """
        hull = self.hull
        edges = hull.rounding
        across = np.minimum(np.abs(y) / hull.half, 1.05)
        side = np.abs(y) - hull.half * self.section(z) * self.plan(d)
        ahead, behind = hull.sweep
        front = (self.nose(z) + ahead * across**hull.bend - d) / self._steepness(self.nose, z)
        rear = (d - self.tail(z) + behind * across**hull.bend) / self._steepness(self.tail, z)
        roof = z - self.top(d) + hull.crown * across**2.5
        roof = roof / np.hypot(1.0, np.clip(self.top.slope(d), -_STEEPEST, _STEEPEST))
        body = intersect(intersect(side, front, edges.front), rear, edges.rear)
        body = intersect(body, roof, edges.roof)
        return intersect(body, self.bottom(d) - z, edges.floor)

    @staticmethod
    def _steepness(outline: ProfileCurve, z: Floats) -> Floats:
        """What makes the field of an end metric."""
        slope = np.clip(outline.slope(z), -_STEEPEST, _STEEPEST)
        return np.asarray(np.hypot(1.0, slope))

    @property
    def bounds(self) -> Floats:
        """Lowest and highest (d, |y|, z), (2, 3) [m]."""
        hull = self.hull
        first = min(d for _, d in hull.nose)
        last = max(d for _, d in hull.tail)
        low = min(z for _, z in hull.bottom)
        high = max(z for _, z in hull.top)
        return np.array([[first, 0.0, low], [last, hull.half, high]])


def shell_of(hull: Hull) -> Shell:
    """Prepare the splines of a shell."""
    smooth = hull.smooth
    return Shell(
        hull,
        ProfileCurve.through(hull.nose, smooth=smooth),
        ProfileCurve.through(hull.tail, smooth=smooth),
        ProfileCurve.through(hull.top, smooth=smooth),
        ProfileCurve.through(hull.bottom, smooth=smooth),
        ProfileCurve.through(hull.section, smooth=smooth),
        ProfileCurve.through(hull.plan, smooth=max(smooth, 0.05)),
    )


def shell_surface(shell: Shell, *, spacing: float) -> Surface:
    """Mesh the half of a shell with y >= 0, all faces tagged 0.

    Args:
        shell: The shell.
        spacing: Of the grid [m].
    """
    low, high = shell.bounds
    d = _graded(low[0] - _MARGIN, high[0] + _MARGIN, spacing)
    z = _steps(low[2] - _MARGIN, high[2] + _MARGIN, spacing)
    y = np.concatenate([[-0.6 * spacing], _steps(0.6 * spacing, high[1] + _MARGIN, spacing)])
    return half_surface(shell.field, (d, y, z), spacing=spacing)


def _steps(low: float, high: float, spacing: float) -> Floats:
    """Equal steps of about a spacing [m]."""
    return np.linspace(low, high, max(4, round((high - low) / spacing)) + 1)


def _graded(low: float, high: float, spacing: float) -> Floats:
    """Steps of a spacing near the ends and of about twice as much between [m]."""
    if high - low < 3.0 * _ENDS:
        return _steps(low, high, spacing)
    middle = _steps(low + _ENDS, high - _ENDS, _COARSER * spacing)
    first, last = _steps(low, low + _ENDS, spacing), _steps(high - _ENDS, high, spacing)
    return np.concatenate([first[:-1], middle, last[1:]])


def surface_at(shells: Sequence[Shell], view: str, point: Floats) -> float:
    """Return where a ray along a view first meets one of some shells.

    Args:
        shells: They may overlap.
        view: `front`, `rear`, `side`, `left`, `right` or `top`.
        point: (d, y, z) [m]; its coordinate along the view does not count.

    Returns:
        That coordinate of the surface [m].

    Raises:
        ConfigError: If the ray meets none.
    """
    axis = {"front": 0, "rear": 0, "top": 2}.get(view, 1)
    low = np.min([shell.bounds[0] for shell in shells], axis=0)
    high = np.max([shell.bounds[1] for shell in shells], axis=0)
    middle = 0.0 if axis == 1 else 0.5 * (low + high)[axis]
    outside = low[axis] - 0.1 if view == "front" else high[axis] + 0.1
    if view == "right":
        outside = -outside
    steps = np.linspace(outside, middle, 4000)
    points = np.tile(np.asarray(point, dtype=np.float64), (len(steps), 1))
    points[:, axis] = steps
    inside = np.min([shell.field(*points.T) for shell in shells], axis=0) < 0.0
    if not inside.any():
        place = ", ".join(f"{value:.2f}" for value in point)
        raise ConfigError(f"a piece clings to nothing at ({place})", key="recipe.pieces")
    return float(steps[inside.argmax()])
