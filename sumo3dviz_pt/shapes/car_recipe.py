"""What a car model is made from: a few measures and splines read off a side elevation.

All recipe coordinates are d, the distance behind the front bumper, |y| and the height
z, in metres. Splines are lists of pairs: (d, z) for lines of the side elevation, (z, d)
for the outlines of nose, tail and rear window.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, TypeVar

from sumo3dviz_pt.errors import ConfigError

Points = tuple[tuple[float, ...], ...]
VIEWS = ("front", "rear", "side", "top")
"""Directions from which a panel's outline is projected."""

_T = TypeVar("_T", bound="WheelRecipe | Panel | CarRecipe")

MATERIALS = (
    "paint",
    "glass",
    "trim",
    "rubber",
    "rim",
    "chrome",
    "lamp_white",
    "lamp_red",
    "lamp_amber",
    "plate",
)
"""Materials of a car's parts; a face's tag is the place in this list."""


@dataclass(frozen=True, slots=True)
class WheelRecipe:
    """Wheels of a car.

    Attributes:
        radius: Of the tyre [m].
        width: Of the tyre [m].
        rim: Radius of the rim as a share of the tyre's, (0, 1).
        spokes: Number of spokes; 0 is a closed disc.
        spoke_width: At the rim [m].
    """

    radius: float
    width: float
    rim: float = 0.7
    spokes: int = 5
    spoke_width: float = 0.07


@dataclass(frozen=True, slots=True)
class Panel:
    """An outline projected onto the body: a lamp, a grille, a gap.

    Attributes:
        view: `front` and `rear` take (|y|, z), `side` takes (d, z), `top` takes (d, |y|).
        outline: Corners of the outline [m].
        material: What the inside becomes; for a gap the line itself becomes trim.
        radius: Of the corners [m].
        reach: How far the projection reaches from the bumper [m] and how this grows
            with height above the outline's first corner.
        recess: How far the inside is pushed into the body [m].
        over: Materials that the panel replaces.
    """

    view: str
    outline: Points
    material: str = "trim"
    radius: float = 0.02
    reach: tuple[float, float] = (0.6, 0.0)
    recess: float = 0.0
    over: tuple[str, ...] = ("paint",)

    def __post_init__(self) -> None:
        """Check names, which no type can."""
        for name in (self.material, *self.over):
            if name not in MATERIALS:
                raise ConfigError(f"no material is called {name!r}", key="recipe.panels")
        if self.view not in VIEWS:
            raise ConfigError(f"no view is called {self.view!r}", key="recipe.panels")


@dataclass(frozen=True, slots=True)
class CarRecipe:
    """A passenger car.

    Attributes:
        length: Bumper to bumper [m].
        width: Without mirrors [m].
        height: [m].
        axles: d of front and rear axle [m].
        wheel: The wheels.
        clearance: Height of the sill's lower edge [m].
        cowl: (d, z) where windscreen and bonnet meet [m].
        header: d of the windscreen's upper edge [m].
        belt: Lower edge of the side windows, (d, z).
        top: Bonnet, shoulder and boot lid along the middle, (d, z).
        roof: Roof along the middle, (d, z).
        nose: Front outline, (z, d).
        tail: Rear outline, (z, distance ahead of the rear bumper).
        backlight: Rear window outline, (z, d).
        doors: First and last d of each door on a side.
        pillars: (d, half width) of the pillars between the side windows.
        window_end: Distance of the last side window from the rear window's outline [m].
        rear_window: Lower and upper height of the rear window's glass [m].
        shoulder: Height of the widest line [m].
        crease: Depth of the character line [m].
        tumblehome: Inward slope of the side windows.
        bonnet: d of the bonnet's rear shut line [m].
        corners: How far front and rear corners sweep back in plan [m].
        cladding: Width of dark wheel arch claddings [m]; 0 for none.
        rails: Whether the roof carries rails.
        bed: First d, last d and floor height of a pickup's bed, or empty [m].
        plates: Heights of the number plates, front and rear [m].
        panels: Lamps, grilles, intakes, in this order.
        gaps: Shut lines beside those of doors and bonnet.
    """

    length: float
    width: float
    height: float
    axles: tuple[float, float]
    wheel: WheelRecipe
    clearance: float
    cowl: tuple[float, float]
    header: float
    belt: Points
    top: Points
    roof: Points
    nose: Points
    tail: Points
    backlight: Points
    doors: Points
    rear_window: tuple[float, float]
    shoulder: float
    bonnet: float
    plates: tuple[float, float]
    pillars: Points = ()
    window_end: float = 0.26
    crease: float = 0.018
    tumblehome: float = 0.30
    corners: tuple[float, float] = (0.34, 0.22)
    cladding: float = 0.0
    rails: bool = False
    bed: tuple[float, ...] = ()
    panels: tuple[Panel, ...] = ()
    gaps: tuple[Panel, ...] = ()

    @property
    def arch_radius(self) -> float:
        """Radius of the wheel arches [m]."""
        return self.wheel.radius + 0.045


def read_recipe(asset: Mapping[str, Any]) -> CarRecipe:
    """Read the recipe of a vehicle asset.

    Args:
        asset: Content of `asset.yaml`: sizes, and the rest under `recipe`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    sizes = {key: asset[key] for key in ("length", "width", "height") if key in asset}
    recipe = dict(asset.get("recipe", {}), **sizes)
    recipe["wheel"] = _read(WheelRecipe, recipe.get("wheel"), "recipe.wheel")
    for name in ("panels", "gaps"):
        items = recipe.get(name, ())
        recipe[name] = tuple(
            _read(Panel, item, f"recipe.{name}[{k}]") for k, item in enumerate(items)
        )
    return _read(CarRecipe, recipe, "recipe")


def _read(kind: type[_T], content: Any, place: str) -> _T:
    """Build a recipe value from a mapping, checking its keys."""
    if not isinstance(content, Mapping):
        raise ConfigError("must be a mapping", key=place)
    known = {field.name: field for field in fields(kind)}
    unknown = sorted(set(content) - set(known))
    needed = {n for n, f in known.items() if f.default is MISSING}
    missing = sorted(needed - set(content))
    if unknown or missing:
        word = f"unknown key {unknown[0]!r}" if unknown else f"key {missing[0]!r} is missing"
        raise ConfigError(word, key=place)
    return kind(**{name: _tuples(value) for name, value in content.items()})


def _tuples(value: Any) -> Any:
    """Lists as tuples, all the way down."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list | tuple) else value
