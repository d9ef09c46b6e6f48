"""The catalogue as exhibits, every asset by itself, and a still life that skies are shown with.

The still life is a car, a house and a tree beside a road.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.bodies import Body, build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.cast.colours import CLOTHES
from sumo3dviz_pt.cast.drawing import Unit, full_bodies
from sumo3dviz_pt.cast.fitting import Prototypes
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.materials import MATERIALS, metres_per_tile, principled, surface_material
from sumo3dviz_pt.library.paints import EUROPEAN
from sumo3dviz_pt.library.people.people import figure
from sumo3dviz_pt.library.street import furniture, signs, traffic_light
from sumo3dviz_pt.library.street.furniture import FURNITURE
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import OWN, Bsdf, Part, Poses, is_tinted
from sumo3dviz_pt.world.objects.houses import STYLES, Chance, house_parts
from sumo3dviz_pt.world.objects.kinds import KINDS, PLANTS, Plant, body_of
from sumo3dviz_pt.world.objects.objects import material_of

LEVELS = ("full", "middle", "far")
"""Of vehicles."""

_LEVELLED = frozenset(
    {
        *("city_car", "sedan", "suv", "coupe", "pickup", "taxi"),
        *("people_carrier", "van_compact", "ambulance", "fire_engine", "motorcycle", "e_scooter"),
    }
)
"""Models that the sheet of levels shows; all have full detail."""

_SLAB = 8.0  # side of a surface's sample [m]
_SMALL_SLAB = 3.0  # of those on which bricks and tiles should be seen [m]
_LAID = frozenset({"brick", "plaster", "roof_tiles", "paving"})


@dataclass(frozen=True, slots=True, eq=False)
class Exhibit:
    """One thing to look at.

    Attributes:
        title: Its name and, where there are several of it, what tells them apart.
        parts: In a frame of their own, on the ground.
        materials: What they are made of.
    """

    title: str
    parts: tuple[Part, ...]
    materials: Mapping[str, Bsdf] = field(default_factory=dict)

    @property
    def bounds(self) -> Floats:
        """Lowest and highest corner, (2, 3) [m]."""
        corners = np.stack([part.mesh.bounds for part in self.parts])
        return np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])

    @property
    def triangles(self) -> int:
        """In all."""
        return sum(len(part.mesh.faces) for part in self.parts)


def exhibits(family: str) -> Iterator[Exhibit]:
    """Yield everything of a family.

    Raises:
        ConfigError: If there is no such family; the message suggests one.
    """
    if family not in FAMILIES:
        hint = catalog.did_you_mean(family, FAMILIES)
        raise ConfigError(f"there is no contact sheet of {family!r}{hint}")
    yield from FAMILIES[family]()


def _vehicles() -> Iterator[Exhibit]:
    """All vehicles at the level at which films mostly show them."""
    for number, body in enumerate(_bodies()):
        yield _exhibit(body, "middle", number)


def _levels() -> Iterator[Exhibit]:
    """A dozen vehicles at all levels of detail."""
    for number, body in enumerate(_bodies(_LEVELLED)):
        for level in LEVELS:
            yield _exhibit(body, level, number)


def _bodies(chosen: Collection[str] = ()) -> Iterator[Body]:
    """Vehicles in their own size; no names stand for all."""
    prototypes: Prototypes = {}
    for model in models_for({}):
        if chosen and model.name not in chosen:
            continue
        choice = ModelChoice(model, sorted(model.vclasses)[0], model.size)
        yield build_body(choice, prototypes)


def _exhibit(body: Body, level: str, number: int) -> Exhibit:
    """A vehicle at a level of detail, in a colour of its own."""
    colour = EUROPEAN.colours[(3 * number + 10) % len(EUROPEAN.colours)]
    parts = [part for unit in body.assembly.units for part in _unit_parts(unit, level)]
    parts += [part for unit in body.assembly.units for part in _joint_parts(unit, level)]
    painted = tuple(_painted(part, colour) for part in parts)
    name = body.assembly.model.partition("@")[0]
    title = name if level == "middle" else f"{name}, {level}"
    return Exhibit(title, painted, {**MATERIALS, **body.materials})


def _unit_parts(unit: Unit, level: str) -> list[Part]:
    """The meshes of one unit in the whole's frame."""
    place = Transform.from_pose((unit.at, 0.0, 0.0))
    if level != "full":
        parts = unit.prototype.far if level == "far" else unit.prototype.parts
        return [replace(part, mesh=place.mesh(part.mesh)) for part in parts]
    made = full_bodies([unit])
    pieces = [Part(place.mesh(p.mesh), p.material, p.tint) for p in made[unit.full].parts]
    for wheel in unit.wheels:
        back = (wheel.at[1] < 0.0) != wheel.reversed
        turned = place @ Transform.from_pose(wheel.at, yaw=np.pi if back else 0.0)
        pieces += [Part(turned.mesh(p.mesh), p.material) for p in made[unit.wheel].parts]
    return pieces


def _joint_parts(unit: Unit, level: str) -> list[Part]:
    """What hangs behind a unit, straight, in the whole's frame."""
    if unit.joint is None:
        return []
    place = Transform.from_pose((unit.at - unit.joint.ahead, 0.0, 0.0))
    parts = unit.joint.prototype.far if level == "far" else unit.joint.prototype.parts
    return [Part(place.mesh(part.mesh), part.material) for part in parts]


def _painted(part: Part, colour: Colour) -> Part:
    """A part whose mover's colour is known."""
    if part.tint is not None and part.role == OWN:
        return replace(part, tint=part.tint * colour)
    if part.tint is not None or not is_tinted(MATERIALS.get(part.material, {})):
        return part
    return Part(part.mesh, part.material, np.tile(colour, (len(part.mesh.faces), 1)))


def _people() -> Iterator[Exhibit]:
    """Everyone in the middle of a step, in clothes of different colours."""
    for number, look in enumerate(catalog.names("people")):
        parts, poses = figure(catalog.find("people", look).meta["recipe"])
        colour = CLOTHES.colours[(5 * number) % len(CLOTHES.colours)]
        dressed = (_painted(part, colour) for part in _in_pose(parts, poses, 1 + number % 8))
        yield Exhibit(look, tuple(dressed), MATERIALS)


def _in_pose(parts: Sequence[Part], poses: Poses, pose: int) -> Iterator[Part]:
    """The parts of a body in one of its poses."""
    first = 0
    for part in parts:
        own = slice(first, first + len(part.mesh.vertices))
        mesh = Mesh(poses.vertices[pose, own], part.mesh.faces, poses.normals[pose, own])
        yield replace(part, mesh=mesh)
        first = own.stop


def _plants() -> Iterator[Exhibit]:
    """All species, nearest level."""
    for kind in KINDS:
        if kind.name in PLANTS:
            for model in kind.models:
                settings = ObjectSettings(model=(model,), variation=0.0)
                parts = body_of(Plant(kind, settings, 1, model, 0))
                yield Exhibit(model, parts, MATERIALS)


def _buildings() -> Iterator[Exhibit]:
    """All models of buildings, nearest level."""
    for kind in KINDS:
        for model in STYLES.get(kind.name, ()):
            settings = ObjectSettings(model=(model,), variation=0.0)
            parts = house_parts(kind, settings, Chance(1, model), level=0)
            materials = {part.material: material_of(part.material, textured=True) for part in parts}
            yield Exhibit(f"{kind.name}: {model}", parts, materials)


def _street() -> Iterator[Exhibit]:
    """Furniture, signs, signals and lamps, turned so that they face +x."""
    turn = Transform.from_pose((0.0, 0.0, 0.0), yaw=np.pi)
    for shown in _facing_traffic():
        parts = (Part(turn.mesh(part.mesh), part.material, part.tint) for part in shown.parts)
        yield Exhibit(shown.title, tuple(parts), MATERIALS)


def _facing_traffic() -> Iterator[Exhibit]:
    """What stands along streets, looking to -x."""
    for name, build in FURNITURE.items():
        yield Exhibit(name, tuple(build(0)), MATERIALS)
    faces = {"speed limit": signs.speed_limit(50), "stop": signs.stop()}
    faces |= {"give way": signs.give_way(), "priority": signs.priority_road()}
    for name, face in faces.items():
        yield Exhibit(name, tuple(signs.on_post(face)), MATERIALS)
    yield Exhibit("exit board", tuple(signs.exit_board(("NORD",))), MATERIALS)
    metal = [Part(furniture.pole(8.0), "galvanised"), Part(furniture.head(8.0), "galvanised")]
    yield Exhibit("street lamp", tuple(metal), MATERIALS)
    for lamps in (2, 3):
        up = Transform.from_pose((0.0, 0.0, 2.4))
        head = [Part(up.mesh(traffic_light.housing(lamps)), "signal_housing")]
        head += [Part(up.mesh(traffic_light.border(lamps)), "signal_border")]
        pole = Part(traffic_light.pole(2.4 + 0.3 * lamps), "signal_pole")
        yield Exhibit(f"signal, {lamps} heads", (*head, pole), MATERIALS)


def _surfaces() -> Iterator[Exhibit]:
    """Samples of all surfaces, lying on the ground."""
    for name in catalog.names("surfaces"):
        side = _SMALL_SLAB if name in _LAID else _SLAB
        x, y = 0.5 * side * np.array([[-1, 1, 1, -1], [-1, -1, 1, 1]])
        top = np.column_stack([x, y, np.full(4, 0.05)])
        uvs = np.column_stack([x, y]) / metres_per_tile(name)
        mesh = Mesh(top, np.array([[0, 1, 2], [0, 2, 3]]), None, uvs)
        yield Exhibit(name, (Part(mesh, name),), {name: surface_material(name, textured=True)})


FAMILIES: Mapping[str, Callable[[], Iterator[Exhibit]]] = {
    "vehicles": _vehicles,
    "levels": _levels,
    "people": _people,
    "trees": _plants,
    "buildings": _buildings,
    "street": _street,
    "surfaces": _surfaces,
}
"""Contact sheets by name."""


_FAR = 3000.0
_ROAD = (-8.6, -1.6)  # its edges, left of an eye that looks along it [m]
_LINE = "line"

_THINGS = (
    # family, title, place before the eye: ahead, left [m], yaw [rad]
    ("vehicles", "hatchback", (12.0, -3.3), np.pi),
    ("buildings", "homes: plaster", (31.0, 10.0), np.radians(-125.0)),
    ("trees", "lime", (36.0, -19.0), 0.4),
)


def still_life(yaw: float) -> Exhibit:
    """Return everything before an eye at the origin.

    Args:
        yaw: Where the eye looks to, counter-clockwise from east [rad].
    """
    turned = Transform.from_pose((0.0, 0.0, 0.0), yaw=yaw)
    parts: list[Part] = []
    materials: dict[str, Bsdf] = {_LINE: principled((0.62, 0.62, 0.60), roughness=0.45)}
    for name, mesh in _land():
        parts.append(Part(turned.mesh(mesh), name))
        if name != _LINE:
            materials[name] = surface_material(name, textured=True)
    for family, title, (ahead, left), faces in _THINGS:
        shown = next(thing for thing in exhibits(family) if thing.title == title)
        place = turned @ Transform.from_pose((ahead, left, 0.0), yaw=faces)
        parts += [Part(place.mesh(part.mesh), part.material, part.tint) for part in shown.parts]
        materials |= dict(shown.materials)
    return Exhibit("still life", tuple(parts), materials)


def _land() -> Iterator[tuple[str, Mesh]]:
    """Meadow, road and lines by their materials."""
    right, left = _ROAD
    yield "ground_grass", _quad("ground_grass", (-_FAR, _FAR), (-_FAR, _FAR), -0.06)
    yield "asphalt", _quad("asphalt", (-60.0, _FAR), (right, left), 0.0)
    edges = [((-20.0, _FAR), (y - 0.06, y + 0.06)) for y in (right + 0.3, left - 0.3)]
    middle = 0.5 * (right + left)
    dashes = [((x, x + 4.0), (middle - 0.06, middle + 0.06)) for x in np.arange(-6.0, 300.0, 12.0)]
    for ahead, across in (*edges, *dashes):
        yield _LINE, _quad(None, ahead, across, 0.004)


def _quad(
    surface: str | None, ahead: tuple[float, float], across: tuple[float, float], height: float
) -> Mesh:
    """A level rectangle [m], with the texture coordinates of a surface."""
    x, y = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])
    places: Floats = np.column_stack([np.array(ahead)[x], np.array(across)[y]])
    uvs = None if surface is None else places / metres_per_tile(surface)
    corners = np.column_stack([places, np.full(4, height)])
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), None, uvs)
