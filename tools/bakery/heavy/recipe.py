"""What a heavy vehicle is made from: shells, what is cut into them, and what is fixed to them.

All recipe coordinates are d, the distance behind the front, y to the left and the height
z, in metres. Outlines of shells are splines: lists of pairs (z, d) for nose and tail,
(d, z) for roof and floor, (z, share of the half width) for the cross section.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from bakery.build import with_sizes
from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.vehicles.lamps import LampSpot
from sumo3dviz_pt.library.vehicles.recipe import read_value

Points = tuple[tuple[float, ...], ...]

View = Literal["front", "rear", "side", "left", "right", "top"]
"""Direction from which an outline is projected; `side` is both flanks."""

FittingKind = (
    Literal["block", "plate", "rod", "turned", "dome", "sheet", "text", "mudguard"]
    | Literal["loft", "skin", "foil"]
)
"""Kind of a fitting; see `pieces.py`, the last three in `lofts.py`."""

WheelStyle = Literal["convex", "concave", "cap"]
"""`convex` bulges outwards, as on front axles; `concave` is a deep dish, as on driven and trailer
axles; `cap` is a plain steel wheel with a cover."""

GAP = "gap"
"""Material of shut lines."""


@dataclass(frozen=True, slots=True)
class HeavyWheel(RecipeValue):
    """A wheel.

    Attributes:
        radius: Of the tyre [m].
        width: Of one tyre [m].
        rim: Radius of the rim as a share of the tyre's, (0, 1).
        style: Shape of the rim.
        material: Of the rim.
    """

    radius: float
    width: float
    rim: float = 0.57
    style: WheelStyle = "convex"
    material: str = "rim"


@dataclass(frozen=True, slots=True)
class Axle(RecipeValue):
    """A pair of wheels, or of twin wheels.

    Attributes:
        at: d of the axle [m].
        out: |y| of the outer tyres' outer walls [m].
        style: Shape of the rims; empty takes that of the recipe's wheel.
        twin: Whether there are two tyres on each side.
        steered: Whether the wheels steer.
    """

    at: float
    out: float
    style: Literal["", WheelStyle] = ""
    twin: bool = False
    steered: bool = False


@dataclass(frozen=True, slots=True)
class HullPanel(RecipeValue):
    """An outline projected onto a shell: a window, a lamp, a stripe, a shut line.

    Attributes:
        view: `front` and `rear` take (|y|, z), `side`, `left` and `right` take (d, z),
            `top` takes (d, |y|).
        outline: Corners of the outline [m].
        material: What the inside becomes; of a shut line, the line.
        radius: Of the corners [m].
        recess: How far the inside is pushed into the shell [m].
        over: Materials that it replaces; empty for that of the shell.
        repeat: How many.
        step: From one to the next along the first coordinate [m].
        reach: How far front and rear panels reach along the shell [m].
        width: Of a shut line [m].
    """

    view: View
    outline: Points
    material: str = GAP
    radius: float = 0.02
    recess: float = 0.0
    over: tuple[str, ...] = ()
    repeat: int = 1
    step: float = 1.0
    reach: float = 0.6
    width: float = 0.010


@dataclass(frozen=True, slots=True)
class Rounding(RecipeValue):
    """Radii of a shell's edges.

    Attributes:
        front: Of the flanks to the front [m].
        rear: Of the flanks to the rear [m].
        roof: Around the roof [m].
        floor: Around the floor [m].
    """

    front: float
    rear: float
    roof: float
    floor: float


@dataclass(frozen=True, slots=True)
class Waves(RecipeValue):
    """Waves of a sheet; a pitch longer than the sheet means none that way.

    Attributes:
        height: Of a wave [m].
        along: Pitch along the sheet [m].
        upwards: Pitch upwards [m].
    """

    height: float
    along: float
    upwards: float


_ROUNDING = Rounding(front=0.06, rear=0.04, roof=0.06, floor=0.02)
_FLAT = Waves(height=0.0, along=1.0, upwards=1.0)


@dataclass(frozen=True, slots=True)
class Hull(RecipeValue):
    """A closed shell with rounded edges, symmetric in y.

    Attributes:
        nose: Front outline, (z, d).
        tail: Rear outline, (z, d).
        half: Largest half width [m].
        top: Roof along the middle, (d, z).
        bottom: Floor, (d, z).
        section: Half width over z as a share of the largest, (z, share).
        plan: Half width over d as a share of the largest, (d, share).
        sweep: How far front and rear corners lie behind and ahead of the middle [m].
        crown: How much lower the roof is at the sides than in the middle [m].
        bend: Exponent of sweep and crown over |y|.
        rounding: Radii of its edges.
        smooth: Blur of the splines [m].
        material: Where nothing is cut.
        under: Material of the underside.
        arches: Radius of wheel arches over the tyre's [m]; 0 for none.
        spacing: Of the grid on which it is meshed [m].
        faces: Triangles to aim at, for one half.
        panels: What is cut, in this order.
        gaps: Shut lines, cut last.
    """

    nose: Points
    tail: Points
    half: float
    top: Points
    bottom: Points
    section: Points = ((0.0, 1.0), (4.0, 1.0))
    plan: Points = ((0.0, 1.0), (20.0, 1.0))
    sweep: tuple[float, float] = (0.0, 0.0)
    crown: float = 0.02
    bend: float = 3.0
    rounding: Rounding = _ROUNDING
    smooth: float = 0.03
    material: str = "paint"
    under: str = "trim"
    arches: float = 0.0
    spacing: float = 0.09
    faces: int = 3000
    panels: tuple[HullPanel, ...] = ()
    gaps: tuple[HullPanel, ...] = ()


@dataclass(frozen=True, slots=True)
class Fitting(RecipeValue):
    """Something fixed to the shells.

    Attributes:
        kind: One of `FittingKind`.
        material: Of all of it.
        low: Lowest corner (d, y, z); of a turned body its centre [m].
        high: Highest corner (d, y, z) [m].
        outline: Of a plate: corners in its view; of a turned body (radius, along); of a
            rod the path (d, y, z) [m]; of a loft, skin or foil its sections, see `lofts.py`.
        view: Of a plate, sheet or text: the direction from which it is seen; of a turned
            body the axis it is turned around.
        span: Of a plate: where it begins and ends along its view [m].
        round: Radius of bevels, rods and mudguards [m].
        waves: Of a sheet.
        text: Of a text.
        mirror: Whether there is another one at -y.
        repeat: How many.
        step: From one to the next (d, y, z) [m].
        outside: Whether it may stick out of the declared size, as mirrors do.
        far: Whether the far level has it, as a box.
        cling: A view: coordinates along it then count from the shells' surface, outwards
            of which they are negative for `front` and positive otherwise.
    """

    kind: FittingKind
    material: str = "trim"
    low: tuple[float, float, float] = (0.0, 0.0, 0.0)
    high: tuple[float, float, float] = (0.0, 0.0, 0.0)
    outline: Points = ()
    view: str = "side"
    span: tuple[float, float] = (0.0, 0.0)
    round: float = 0.01
    waves: Waves = _FLAT
    text: str = ""
    mirror: bool = False
    repeat: int = 1
    step: tuple[float, float, float] = (0.0, 0.0, 0.0)
    outside: bool = False
    far: bool = False
    cling: Literal["", View] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxRecipe(RecipeValue):
    """A heavy vehicle.

    Attributes:
        length: Front to rear [m].
        width: Without mirrors [m].
        height: [m].
        wheel: Its wheels.
        axles: Where they are.
        hulls: Its shells.
        pieces: What is fixed to them.
        lamps: What shines.
        stretch: The range of d in which it may be stretched, or empty [m].
    """

    length: float
    width: float
    height: float
    wheel: HeavyWheel
    axles: tuple[Axle, ...]
    hulls: tuple[Hull, ...]
    pieces: tuple[Fitting, ...] = ()
    lamps: tuple[LampSpot, ...] = ()
    stretch: tuple[float, ...] = ()


def read_box(asset: Mapping[str, Any]) -> BoxRecipe:
    """Read the recipe of a heavy vehicle.

    Args:
        asset: Content of `asset.yaml`: sizes, and the rest under `recipe`.

    Raises:
        ConfigError: If a key is unknown, missing or of the wrong kind.
    """
    return read_value(BoxRecipe, with_sizes(asset))
