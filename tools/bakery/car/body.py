"""The body of a car as a field: lower body, cabin, a pickup's bed.

Coordinates are d (behind the front bumper), y and z in metres; the body is symmetric
in y. Constants without another source were fitted by eye to side elevations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bakery.car.recipe import Bed, CarRecipe
from bakery.halves import half_surface
from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import ProfileCurve, intersect, unite
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.numbers import eased

WELL_DEPTH = 0.30
"""How far wheel wells reach inwards from the flank [m]."""

_HOLLOW = 0.013
PILLAR_LEAN = 0.06
"""Run of pillars and door edges per height, backwards when going up."""


@dataclass(frozen=True, slots=True, eq=False)
class CarShape:
    """A recipe with its splines made ready.

    Attributes:
        recipe: Where it comes from.
        plan: Half width along d, as a share of the largest.
        section: Half width along z, as a share of the largest.
        belt: Lower edge of the side windows over d.
        top: Bonnet, shoulder and boot over d.
        roof: Roof over d.
        nose: Front outline over z.
        tail: Rear outline over z.
        backlight: Rear window over z.
        crease: Height of the character line over d.
        fade: How strong the character line is over d.
        ledge: Height of the doors' lower crease over d.
        hollow: How far doors are hollow between their ledge and the character line [m].
        sharp: Over which height that line fades downwards [m].
    """

    recipe: CarRecipe
    plan: ProfileCurve
    section: ProfileCurve
    belt: ProfileCurve
    top: ProfileCurve
    roof: ProfileCurve
    nose: ProfileCurve
    tail: ProfileCurve
    backlight: ProfileCurve
    crease: ProfileCurve
    fade: ProfileCurve
    ledge: ProfileCurve
    hollow: float = _HOLLOW
    sharp: float = 0.03

    @property
    def half(self) -> float:
        """Half of the width [m]."""
        return self.recipe.width / 2.0

    @property
    def rake(self) -> float:
        """Run of the windscreen per height."""
        d, z = self.recipe.cowl
        return (self.recipe.header - d) / (float(self.roof(self.recipe.header)) - z)

    def windscreen(self, z: Floats) -> Floats:
        """Return the distance d of the windscreen's middle at heights z [m]."""
        d, low = self.recipe.cowl
        return np.asarray(d + (z - low) * self.rake + 0.10 * np.maximum(z - low, 0.0) ** 2)

    def side_glass(self, d: Floats, z: Floats) -> Floats:
        """Return |y| of the side windows [m]."""
        above = np.maximum(z - self.belt(d), -0.02)
        base = self.half * self.plan(d) * 0.958 - 0.012
        slope = self.recipe.tumblehome
        return np.asarray(base - slope * above - 0.22 * np.maximum(above, 0.0) ** 2)

    def from_axle(self, d: Floats, z: Floats) -> Floats:
        """Return distances from the nearer axle in the side view [m]."""
        front, rear = self.recipe.axles
        up = z - self.recipe.wheel.radius
        return np.asarray(np.minimum(np.hypot(d - front, up), np.hypot(d - rear, up)))

    def field(self, d: Floats, y: Floats, z: Floats) -> Floats:
        """Return the body's field: negative inside.

        Args:
            d: Distance behind the front [m].
            y: To the left, of the same shape [m].
            z: Height, of the same shape [m].
        """
        body = unite(_lower(self, d, y, z), _cabin(self, d, y, z), 0.022)
        bed = self.recipe.bed
        return body if bed is None else intersect(body, -_bed(self, bed, (d, y, z)), 0.012)


def car_shape(recipe: CarRecipe) -> CarShape:
    """Prepare the splines of a recipe."""
    length, low, wide = recipe.length, recipe.clearance, recipe.shoulder
    belt = ProfileCurve.through(recipe.belt, smooth=0.10)
    middle = float(belt(length / 2.0))
    plan = [
        (0.0, 0.90),
        (0.5, 0.965),
        (1.1, 0.985),
        (0.45 * length, 0.998),
        (0.62 * length, 1.0),
        (length - 0.9, 0.985),
        (length - 0.3, 0.955),
        (length, 0.925),
    ]
    section = [
        (low - 0.10, 0.90),
        (low + 0.02, 0.945),
        (low + 0.10, 0.972),
        (low + 0.22, 0.978),
        (wide - 0.14, 0.988),
        (wide, 1.0),
        (wide + 0.06, 0.998),
        (middle - 0.06, 0.975),
        (middle, 0.955),
        (middle + 0.3, 0.90),
    ]
    crease = [
        (0.0, wide - 0.02),
        (0.9, wide),
        (0.5 * length, wide + 0.035),
        (length - 0.5, wide + 0.085),
        (length, wide + 0.09),
    ]
    fade = [(0.0, 0.0), (0.35, 0.2), (1.3, 1.0), (length - 0.8, 1.0), (length - 0.1, 0.3)]
    ledge = [(0.0, low + 0.15), (0.3 * length, low + 0.15), (length, low + 0.25)]
    return CarShape(
        recipe,
        ProfileCurve.through(plan, smooth=0.15),
        ProfileCurve.through(section, smooth=0.03),
        belt,
        ProfileCurve.through(recipe.top, smooth=0.06),
        ProfileCurve.through(recipe.roof, smooth=0.12),
        ProfileCurve.through(recipe.nose, smooth=0.025),
        ProfileCurve.through(recipe.tail, smooth=0.028),
        ProfileCurve.through(recipe.backlight, smooth=0.03),
        ProfileCurve.through(crease, smooth=0.2),
        ProfileCurve.through(fade, smooth=0.1),
        ProfileCurve.through(ledge, smooth=0.1),
    )


def _side(shape: CarShape, d: Floats, z: Floats) -> Floats:
    """|y| of the body's flank with character line, sill and arch flares [m]."""
    recipe = shape.recipe
    low = recipe.clearance
    fade = shape.fade(d)
    rise = np.clip((z - low - 0.15) / 0.22, 0.0, 1.0)
    below = 1.0 - np.exp(-np.maximum(shape.crease(d) - z, 0.0) / shape.sharp)
    flank = shape.half * shape.plan(d) * shape.section(z)
    flank = flank - eased(rise, recipe.crease * fade * below)
    # The doors end over a ledge that catches the light, and are hollow between it and the crease.
    ledge = shape.ledge(d)
    share = np.clip((z - ledge) / np.maximum(shape.crease(d) - ledge, 0.1), 0.0, 1.0)
    flank = flank - shape.hollow * fade * np.sin(np.pi * share**0.8) ** 2
    under = np.exp(-np.maximum(z - ledge, 0.0) / 0.05) * np.clip(
        (z - ledge + 0.10) / 0.10, 0.0, 1.0
    )
    flank = flank + 0.016 * fade * under
    beyond = np.maximum(shape.from_axle(d, z) - recipe.arch_radius, 0.0)
    flare = 0.018 * np.exp(-((beyond / 0.085) ** 2)) * np.clip((z - low) / 0.1, 0.0, 1.0)
    # Nothing of it is left at the bumpers, or it would dent the corners.
    flare = flare * np.clip(np.minimum(d - 0.25, recipe.length - 0.3 - d) / 0.25, 0.0, 1.0)
    return np.asarray(flank + flare)


def _lower(shape: CarShape, d: Floats, y: Floats, z: Floats) -> Floats:
    """Everything below the windows."""
    recipe, half = shape.recipe, shape.half
    across = np.abs(y) / half
    capped = np.minimum(across, 1.1)
    on_bonnet = np.clip((recipe.cowl[0] + 0.1 - d) / 0.3, 0.0, 1.0)
    ridge = 0.014 * on_bonnet * np.exp(-(((np.abs(y) - 0.50 - 0.16 * d) / 0.05) ** 2))
    lid = z - (shape.top(d) - 0.055 * capped**2.2 + ridge)
    lid = lid / np.sqrt(1.0 + shape.top.slope(d) ** 2)
    front_sweep, rear_sweep = recipe.corners
    front = shape.nose(z) + front_sweep * across**3 - d
    turn = 3.0 * front_sweep * capped**2 / half
    front = front / np.sqrt(1.0 + np.minimum(shape.nose.slope(z), 2.5) ** 2 + turn**2)
    rear = d - (recipe.length - shape.tail(z) - rear_sweep * across**3.2)
    turn = 3.2 * rear_sweep * capped**2.2 / half
    rear = rear / np.sqrt(1.0 + np.minimum(shape.tail.slope(z), 2.0) ** 2 + turn**2)
    body = intersect(np.abs(y) - _side(shape, d, z), np.maximum(front, rear), 0.10)
    body = intersect(body, lid, 0.055)
    lift = 0.06 * np.exp(-((d / 0.4) ** 2))
    lift = lift + 0.09 * np.exp(-(((recipe.length - d) / 0.35) ** 2))
    return intersect(body, recipe.clearance + lift - z, 0.03)


def _cabin(shape: CarShape, d: Floats, y: Floats, z: Floats) -> Floats:
    """The greenhouse: side windows, roof, windscreen, rear window."""
    across = np.abs(y) / shape.half
    side = (np.abs(y) - shape.side_glass(d, z)) / np.hypot(1.0, shape.recipe.tumblehome + 0.15)
    roof = z - (shape.roof(d) - 0.075 * across**2.4)
    front = (shape.windscreen(z) + 0.20 * across**2.2 - d) / np.hypot(1.0, shape.rake)
    slope = np.minimum(np.abs(shape.backlight.slope(z)), 3.0)
    above = np.maximum(z, shape.belt(d) - 0.03)
    rear = (d - (shape.backlight(above) - 0.13 * across**2.5)) / np.hypot(1.0, slope)
    cabin = intersect(side, front, 0.055)
    cabin = intersect(cabin, rear, 0.07)
    # It begins within the lower body, whatever the windows' edge does.
    floor = np.minimum(shape.belt(d) - 0.10, shape.top(d) - 0.15)
    return np.maximum(intersect(cabin, roof, 0.085), floor - z)


def _bed(shape: CarShape, bed: Bed, place: tuple[Floats, Floats, Floats]) -> Floats:
    """The open bed of a pickup."""
    d, y, z = place
    along = np.maximum(bed.begin - d, d - bed.end)
    across = np.abs(y) - (shape.half * 0.93 - 0.09)
    return intersect(intersect(along, across, 0.04), bed.floor - z, 0.03)


def body_surface(shape: CarShape, *, spacing: float) -> Surface:
    """Mesh the half of the body with y >= 0.

    Args:
        shape: The body.
        spacing: Grid spacing where the body bends; flat regions get up to twice this [m].
    """
    recipe = shape.recipe
    length, half, height = recipe.length, shape.half, recipe.height
    d = _axis(-0.08, length + 0.08, spacing, ends=0.7)
    y = np.concatenate(
        [
            [-0.6 * spacing],
            0.6 * spacing + _axis(0.0, half + 0.06, spacing, ends=0.2, only_last=True),
        ]
    )
    low = max(recipe.clearance - 0.08, 0.0)
    z = np.arange(low, height + 0.09, 0.85 * spacing)
    return half_surface(shape.field, (d, y, z), spacing=spacing)


def _axis(
    low: float, high: float, spacing: float, *, ends: float, only_last: bool = False
) -> Floats:
    """Grid coordinates [m], fine within `ends` of the limits (or the last) and coarser between."""
    steps = np.linspace(low, high, 400)
    near = np.minimum(steps - low if not only_last else np.inf, high - steps)
    local = spacing * (1.0 + np.clip((near - ends) / 0.3, 0.0, 1.0))
    count = np.concatenate([[0.0], np.cumsum(0.5 * (1 / local[1:] + 1 / local[:-1]))])
    count *= (high - low) / 399.0
    return np.asarray(np.interp(np.arange(int(np.ceil(count[-1])) + 1), count, steps))
