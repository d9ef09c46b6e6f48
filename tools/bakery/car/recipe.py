"""What a car model is made from: a few measures and splines read off a side elevation.

All recipe coordinates are d, the distance behind the front bumper, |y| and the height
z, in metres. Splines are lists of pairs: (d, z) for lines of the side elevation, (z, d)
for the outlines of nose, tail and rear window. What can shine names its `role`; the
lamps of `baked.yaml` follow from that. An asset with a `base` says only what differs
from that other asset (see `variant`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

from bakery.build import with_sizes
from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.vehicles.recipe import read_value

Points = tuple[tuple[float, ...], ...]

View = Literal["front", "rear", "side", "top"]
"""Direction from which a panel's outline is projected."""

Material = Literal[
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
    "gloss_black",
    "gap",
    "lamp_clear",
    "lamp_dark_red",
    "lamp_bowl",
    "lamp_blue",
    "lamp_sign",
    "plate_ink",
    "disc",
    "glass_seat",
    "livery_cream",
    "livery_white",
    "livery_blue",
    "cabin_pane",
    "rim_dust",
    "tyre_text",
]

MATERIALS: tuple[Material, ...] = get_args(Material)
"""Materials of a car's parts; a face's tag is the place in this list."""

Role = Literal["head", "tail", "brake", "turn", "reverse", "blue", "sign"]
"""What can light a piece; `turn` is `left` on the left side and `right` on the other."""

Style = Literal["projector", "reflector", "eye", "fog", "badge", "tip"]
"""Kind of a round piece."""

Equipment = Literal["", "taxi_sign", "light_bar"]
"""What a car may carry on its roof."""


@dataclass(frozen=True, slots=True)
class WheelRecipe(RecipeValue):
    """Wheels of a car.

    Attributes:
        radius: Of the tyre [m].
        width: Of the tyre [m].
        rim: Radius of the rim as a share of the tyre's, (0, 1).
        spokes: Number of spokes; 0 is a closed disc.
        spoke_width: At the rim [m].
        twin: How far the two bars of a double spoke lie apart at the rim [m]; 0 for single ones.
        two_tone: Whether the spokes' flanks and the rim's inside are black.
    """

    radius: float
    width: float
    rim: float = 0.7
    spokes: int = 5
    spoke_width: float = 0.07
    twin: float = 0.0
    two_tone: bool = False


@dataclass(frozen=True, slots=True)
class CarPanel(RecipeValue):
    """An outline projected onto the body: a lamp, a grille, a gap.

    Attributes:
        view: `front` and `rear` take (|y|, z), `side` takes (d, z), `top` takes (d, |y|).
        outline: Corners of the outline [m].
        material: What the inside becomes; a gap's line is always dark.
        radius: Of the corners [m].
        reach: How far the projection reaches from the bumper [m].
        growth: By how much it reaches farther for each metre above the outline's first corner [m].
        recess: How far the inside is pushed into the body [m].
        over: Materials that the panel replaces.
        role: What lights it: some of `Role`.
        bars: Number of bars across a grille; negative for upright ones.
        bar_material: Of these bars.
    """

    view: View
    outline: Points
    material: Material = "trim"
    radius: float = 0.02
    reach: float = 0.6
    growth: float = 0.0
    recess: float = 0.0
    over: tuple[Material, ...] = ("paint",)
    role: tuple[Role, ...] = ()
    bars: int = 0
    bar_material: Material = "gloss_black"


@dataclass(frozen=True, slots=True)
class BodyStrip(RecipeValue):
    """A bar that follows the body: a light guide, a chrome strip, the blade of a wiper.

    Attributes:
        view: As that of a panel.
        path: Points of its middle line, as those of an outline [m].
        material: Of all of it.
        width: Across [m].
        height: How far it stands out of the body, less than 0 within a recess [m].
        depth: How far it reaches into the body [m].
        role: What lights it: some of `Role`.
    """

    view: View
    path: Points
    material: Material = "chrome"
    width: float = 0.02
    height: float = 0.005
    depth: float = 0.02
    role: tuple[Role, ...] = ()


@dataclass(frozen=True, slots=True)
class Disc(RecipeValue):
    """A round piece on the body: a lamp, a badge, an exhaust pipe.

    Attributes:
        view: As that of a panel.
        at: Its middle, as the points of an outline [m].
        radius: [m].
        style: One of `Style`.
        height: How far its rim stands out of the body, less than 0 within a recess [m].
        role: What lights it: some of `Role`.
    """

    view: View
    at: tuple[float, float]
    radius: float
    style: Style = "projector"
    height: float = 0.0
    role: tuple[Role, ...] = ()


@dataclass(frozen=True, slots=True)
class Bed(RecipeValue):
    """The open bed of a pickup.

    Attributes:
        begin: d of its front wall [m].
        end: d of its rear wall [m].
        floor: Height of its floor [m].
    """

    begin: float
    end: float
    floor: float


@dataclass(frozen=True, slots=True)
class FlankText(RecipeValue):
    """Letters on both flanks.

    Attributes:
        text: What they say.
        at: (d, z) of their middle [m].
        height: [m].
        material: Of the letters.
    """

    text: str
    at: tuple[float, float]
    height: float
    material: Material


@dataclass(frozen=True, slots=True)
class CarRecipe(RecipeValue):
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
        bed: A pickup's bed, or None.
        plates: Heights of the number plates, front and rear [m].
        joints: Heights of the bumpers' shut lines on the flank, front and rear [m].
        flap: (d, z) of the fuel flap, or empty [m].
        handle: Height of the door handles over the character line [m].
        frame: Material around the side windows.
        mirror: Material of the mirrors' shells.
        grip: Material of the door handles.
        rail: Material of the roof rails.
        plate_recess: Depth of the hollow for the rear plate [m].
        body: Material of what is painted.
        wiper: Half length of the rear window's wiper [m]; 0 for none.
        spoiler: How far a lip stands out over the rear window [m]; 0 for none.
        antenna: d of the antenna on the roof [m]; 0 for none.
        equipment: Of a taxi or the police: `taxi_sign` or `light_bar`, or empty.
        flanks: What stands on the flanks, or None.
        badges: What letters say at the rear, left and right of the plate; empty for none.
        panels: Lamps, grilles, intakes, in this order.
        strips: Light guides, chrome and the like.
        discs: Round lamps, badges, exhaust pipes.
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
    crease: float = 0.022
    tumblehome: float = 0.30
    corners: tuple[float, float] = (0.27, 0.2)
    cladding: float = 0.0
    rails: bool = False
    bed: Bed | None = None
    joints: tuple[float, ...] = ()
    flap: tuple[float, ...] = ()
    handle: float = 0.055
    frame: Material = "gloss_black"
    mirror: Material = "paint"
    grip: Material = "paint"
    rail: Material = "chrome"
    plate_recess: float = 0.0
    body: Material = "paint"
    wiper: float = 0.0
    spoiler: float = 0.0
    antenna: float = 0.0
    equipment: Equipment = ""
    flanks: FlankText | None = None
    badges: tuple[str, str] = ("", "")
    panels: tuple[CarPanel, ...] = ()
    strips: tuple[BodyStrip, ...] = ()
    discs: tuple[Disc, ...] = ()
    gaps: tuple[CarPanel, ...] = ()

    @property
    def arch_radius(self) -> float:
        """Radius of the wheel arches [m]."""
        return self.wheel.radius + 0.04


def read_recipe(asset: Mapping[str, Any]) -> CarRecipe:
    """Read the recipe of a car.

    Args:
        asset: Content of `asset.yaml`: sizes, and the rest under `recipe`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    recipe = read_value(CarRecipe, with_sizes(asset))
    return replace(recipe, panels=(*recipe.panels, *_plate_hollow(recipe)))


def _plate_hollow(recipe: CarRecipe) -> tuple[CarPanel, ...]:
    """The hollow that holds the rear plate."""
    if not recipe.plate_recess:
        return ()
    z = recipe.plates[1]
    outline = ((0.0, z - 0.085), (0.31, z - 0.085), (0.33, z + 0.085), (0.0, z + 0.085))
    return (CarPanel("rear", outline, "paint", radius=0.03, recess=recipe.plate_recess),)
