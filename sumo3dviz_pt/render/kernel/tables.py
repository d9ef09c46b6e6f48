"""A scene's geometry and materials as flat arrays, from which the kernel reads what a ray met.

Mitsuba keeps the meshes and finds where a ray meets them. All the rest of a surface, for which
Mitsuba calls a function of every shape, is read from here by numbers: from the shape or instance to
its meshes, from the mesh to its faces, from the face to its corners and material.

`owners_of` says which thing each face belongs to, in the frame that is shown. Meshes that stand say
it by runs (`Mesh.things`), merged meshes of road users by who is shown in each of their places,
instances by their slots. The kernels know nothing of this: they find a face's number, and it is
looked up here, where somebody asks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import UNWORN, Floats, Image, Ints
from sumo3dviz_pt.model.layers import MovingPart
from sumo3dviz_pt.render.compound import METALLIC_ATTRIBUTE, ROUGHNESS_ATTRIBUTE
from sumo3dviz_pt.render.convert import TINT_ATTRIBUTE, faces_of
from sumo3dviz_pt.render.kernel.rows import MaterialKind, Row, RowMaker
from sumo3dviz_pt.render.kernels import aligned, aligned_zeros, in_place
from sumo3dviz_pt.render.loaded import HeldMesh, LoadedScene
from sumo3dviz_pt.render.paint import Paint
from sumo3dviz_pt.render.textures import WEAR_ATTRIBUTE

NO_MESH = 0xFFFFFFFF
"""What the table of shapes says of those that have no mesh: the sun, and instances' bodies."""

MIRRORED = "mirrored"
"""Name of the part that everything in mirrors counts as."""

_SMOOTH = 0x80000000
"""Bit of a face's material that says that its normals are interpolated."""

_INSTANCE = 16  # numbers of an instance: rows of its matrix, colour, own number and flop

_FLOPS, _USES = 21, 64  # how many flops and uses the fraction of its last number tells apart


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a mesh lies in the tables.

    Attributes:
        mesh: The mesh.
        vertex: Its first vertex.
        vertices: How many it has.
        face: Its first face.
        faces: How many it has.
        smooth: Whether its normals are interpolated.
    """

    mesh: HeldMesh
    vertex: int
    vertices: int
    face: int
    faces: int
    smooth: bool


class Tables:
    """Flat arrays of a loaded scene.

    Args:
        loaded: A scene that shows a frame.
        numbered: Whether pictures say what moves.

    Attributes:
        movers: What moves in the frame, in the order of its numbers, if pictures say it.
        rows: Of its materials, by number.
        textures: That the rows refer to.
        lamps: Names of meshes that can shine, by number; a face says which it belongs to.
        worn: Whether any mesh tells how worn it is.
        metals: Whether any face is metallic.
        numbered: Whether pictures say what moves.
        mirrored: Number of what is seen in mirrors, if pictures say what moves.
    """

    mirrored: Any

    def __init__(self, loaded: LoadedScene, *, numbered: bool = False) -> None:
        self._loaded, self._origin, self.numbered = loaded, loaded.origin, numbered
        self.movers: tuple[MovingPart, ...] = ()
        parameters = loaded.parameters
        # Worn meshes come first, so that the table of wear ends with them; merged meshes of what
        # moves come last, so that the table of their faces' numbers begins with them; and of
        # these, what is rooted comes first, as weather treats it like all that stands.
        held = [mesh for mesh in loaded.meshes() if len(parameters[f"{mesh.name}.faces"])]
        telling = [mesh for mesh in held if f"{mesh.name}.{WEAR_ATTRIBUTE}" in parameters]
        names, bodies = {mesh.name for mesh in telling}, {mesh.body for mesh in telling} - {""}
        # The meshes of a body must follow each other.
        meshes = sorted(
            held,
            key=lambda mesh: (
                mesh.moving,
                not mesh.rooted,
                mesh.name not in names and mesh.body not in bodies,
                mesh.body in bodies,
            ),
        )
        self.textures = RowMaker()
        self.lamps = () if loaded.picks is None else loaded.picks.names
        rows = [self.textures.row(mesh.bsdf, painted=mesh.painted) for mesh in meshes]
        self.rows = tuple(dict.fromkeys(rows))
        self._places = _laid_out(meshes, parameters)
        self._mirrors = [
            m for m, row in zip(meshes, rows, strict=True) if MaterialKind.MIRROR in row.kind
        ]
        self._fill(rows)
        self._number_shapes()
        self._instances = self._faces = self._first_moving = None
        movers = [p.face for p in self._places if p.mesh.moving and not p.mesh.rooted]
        self._mover_face = dr.opaque(mi.UInt32, movers[0]) if movers else None
        self.follow()

    def _fill(self, rows: list[Row]) -> None:
        """Write all arrays that depend on meshes only."""
        parameters = self._loaded.parameters
        last = self._places[-1] if self._places else None
        # A scene without meshes has one row that nothing refers to.
        vertices, faces = (last.vertex + last.vertices, last.face + last.faces) if last else (1, 1)
        # Only single numbers come from Mitsuba, and large scenes have many.
        points, normals = (aligned_zeros((vertices, 4), np.float32) for _ in range(2))
        corners = aligned_zeros((faces, 4), np.uint32)
        looks, metals = (aligned_zeros(shape, np.float32) for shape in ((faces, 4), (faces,)))
        worn = [p for p in self._places if f"{p.mesh.name}.{WEAR_ATTRIBUTE}" in parameters]
        wear = np.tile([*UNWORN, 0.0], (worn[-1].vertex + worn[-1].vertices if worn else 1, 1))
        for place, row in zip(self._places, rows, strict=True):
            name = place.mesh.name
            seen = slice(place.vertex, place.vertex + place.vertices)
            points[seen, :3] = _array(parameters, f"{name}.vertex_positions", 3)
            if place.smooth:
                normals[seen, :3] = _array(parameters, f"{name}.vertex_normals", 3)
            uvs = _array(parameters, f"{name}.vertex_texcoords", 2)
            if len(uvs):
                points[seen, 3], normals[seen, 3] = uvs.T
            if place in worn:
                wear[seen, :3] = _array(parameters, f"{name}.{WEAR_ATTRIBUTE}", 3)
            own = slice(place.face, place.face + place.faces)
            corners[own, :3] = faces_of(parameters, name) + place.vertex
            corners[own, 3] = self.rows.index(row) | (_SMOOTH if place.smooth else 0)
            looks[own] = _looks(parameters, name, row, place.faces)
            metals[own] = _by_face(parameters, f"{name}.{METALLIC_ATTRIBUTE}", row.metallic, own)
        self.metals, self.worn = bool(metals.any()), bool(worn)
        # Lamps tell their sets and units by their places in the tables, not by uvs.
        self.points, self.normals, self._looks, self._metals, self._wear = (
            _own(values) for values in (points, normals, looks, metals, wear)
        )
        self._corners = _own(corners, mi.UInt32, np.uint32)
        self._rows = _own(np.array([row.numbers for row in self.rows] or [np.zeros(12)]))

    def _number_shapes(self) -> None:
        """Write which meshes belong to each shape and instance, by Mitsuba's numbers of them."""
        loaded = self._loaded
        order = {place.mesh.name: k for k, place in enumerate(self._places)}
        self._numbers = {shape.id(): _number(shape) for shape in loaded.shapes()}
        parts = dict(self._numbers_of_parts())
        numbers = {**self._numbers, **parts} if loaded.by_shape else self._numbers
        first = np.full(max(numbers.values(), default=0) + 1, NO_MESH, np.uint32)
        for name, number in numbers.items():
            if name in order:
                first[number] = order[name]
        slots = {} if loaded.pool is None else loaded.pool.body_of_slot
        for slot, body in slots.items():
            first[self._numbers[slot]] = order[f"{body}.part0"]
        self._shapes = _own(first, mi.UInt32, np.uint32)
        lamp_of = {name: k + 1 for k, name in enumerate(self.lamps)}
        table = [(p.face, lamp_of.get(p.mesh.name, 0)) for p in self._places]
        self._meshes = _own(np.array(table or [(0, 0)], np.uint32), mi.UInt32, np.uint32)

    def _numbers_of_parts(self) -> Iterator[tuple[str, int]]:
        """Yield the meshes of bodies and Mitsuba's numbers of them."""
        bodies = {} if self._loaded.pool is None else self._loaded.pool.parts
        for body, shapes in bodies.items():
            yield from ((f"{body}.part{k}", _number(shape)) for k, shape in enumerate(shapes))

    def follow(self) -> None:
        """Bring the tables to what the loaded scene shows."""
        loaded, parameters = self._loaded, self._loaded.parameters
        moved = loaded.origin is not self._origin
        self._origin = loaded.origin
        for place in self._places:
            name = place.mesh.name
            if place.mesh.moving or (moved and not place.mesh.body):
                _copy(self.points, parameters[f"{name}.vertex_positions"], place.vertex)
                if place.smooth:
                    _copy(self.normals, parameters[f"{name}.vertex_normals"], place.vertex)
            if (
                place.mesh.moving
                and not place.mesh.rooted
                and f"{name}.{TINT_ATTRIBUTE}" in parameters
            ):
                _copy(self._looks, parameters[f"{name}.{TINT_ATTRIBUTE}"], place.face)
        self._follow_parked()
        placed = {} if loaded.pool is None else loaded.pool.placed
        numbers = np.zeros((dr.width(self._shapes), _INSTANCE))
        for slot, (matrix, paint) in placed.items():
            numbers[self._numbers[slot], :12] = matrix[:3].ravel()
            numbers[self._numbers[slot], 12:15] = paint[:3]
            numbers[self._numbers[slot], 15] = _fraction(paint[3], paint[4])
        if self.numbered:
            self._number_movers(numbers)
        self._instances = mi.Float(aligned(numbers, np.float32))

    def _follow_parked(self) -> None:
        """Write which instances show who never moves; only snow asks."""
        parked = np.zeros(dr.width(self._shapes))
        for slot in () if self._loaded.pool is None else self._loaded.pool.parked:
            parked[self._numbers[slot]] = 1.0
        self._parked = mi.Float(aligned(parked, np.float32))

    def parked(self, hit: Any, active: Any) -> Any:
        """Return whether the instance that was hit shows who never moves."""
        number = dr.reinterpret_array(mi.UInt32, hit.instance)
        there = active & (number != 0)
        return there & (dr.gather(mi.Float, self._parked, number, there) > 0.5)

    def _number_movers(self, instances: Floats) -> None:
        """Write which moving part each instance and each face of a merged mesh belongs to."""
        loaded, known = self._loaded, self._loaded.numbers()
        self.movers = known.parts
        if any(MaterialKind.MIRROR in row.kind for row in self.rows):
            # What a mirror shows moves unlike the mirror: it counts as what changes its shape.
            self.movers += (MovingPart(MIRRORED, None),)
            self.mirrored = dr.opaque(mi.Float, len(self.movers))
        for slot, name in ({} if loaded.pool is None else loaded.pool.shown).items():
            instances[self._numbers[slot], 15] += known.by_name[name]
        merged = [place for place in self._places if place.mesh.moving]
        if merged:
            shown = loaded.numbered_faces
            faces = [known.of_faces(p.faces, shown[p.mesh.name]) for p in merged]
            self._first_moving = dr.opaque(mi.UInt32, merged[0].face)
            self._faces = mi.Float(aligned(np.concatenate(faces), np.float32))

    def mover(self, hit: Any, face: Any, active: Any) -> Any:
        """Return the number of the moving part that was hit; 0 for what stands.

        Args:
            hit: Mitsuba's preliminary intersection.
            face: Number of the face.
            active: Which lanes count.
        """
        number = mi.Float(0.0)
        if self._faces is not None:
            merged = active & (face >= self._first_moving)
            number = dr.gather(mi.Float, self._faces, face - self._first_moving, merged)
        if not self.instanced:
            return number
        instance = dr.reinterpret_array(mi.UInt32, hit.instance)
        there = active & (instance != 0)
        last = dr.gather(mi.Float, self._instances, _INSTANCE * instance + 15, there)
        return dr.select(there, dr.floor(last), number)

    def moves(self, face: Any) -> Any:
        """Return whether a face belongs to a merged mesh of what moves."""
        if self._mover_face is None:
            return mi.Bool(False)
        return face >= self._mover_face

    @property
    def origin(self) -> Floats:
        """The renderer's origin in the network's coordinates, (3,) [m]."""
        assert self._origin is not None, "show a frame first"
        return self._origin

    @property
    def instanced(self) -> bool:
        """Whether there are instances."""
        return any(place.mesh.body for place in self._places)

    def place(self, name: str) -> tuple[int, int]:
        """Return a mesh's first vertex and first face in the tables, by its name."""
        place_of = next(place for place in self._places if place.mesh.name == name)
        return place_of.vertex, place_of.face

    def mirrors(self) -> list[tuple[str, str]]:
        """Return bodies with mirrors, and the names of the mirrors' meshes.

        There are none where something that is no body is a mirror, too.
        """
        if not all(mesh.body for mesh in self._mirrors):
            return []
        return [(mesh.body, mesh.name) for mesh in self._mirrors]

    def meshes(self) -> Iterator[tuple[int, str, int]]:
        """Go through all meshes in their order: first face, name, and how many faces."""
        for place in self._places:
            yield place.face, place.mesh.name, place.faces

    def number_of(self, shape: str) -> int:
        """Return Mitsuba's number of a shape or instance, by its name."""
        return self._numbers[shape]

    def mesh_of(self, hit: Any, active: Any) -> tuple[Any, Any, Any]:
        """Return the first face of the mesh that was hit, its lamps' number, and if it is one.

        Args:
            hit: Mitsuba's preliminary intersection.
            active: Which lanes count.
        """
        shape = dr.reinterpret_array(mi.UInt32, hit.shape)
        number = shape
        indexed = self.instanced and not self._loaded.by_shape
        if indexed:
            instance = dr.reinterpret_array(mi.UInt32, hit.instance)
            number = dr.select(instance != 0, instance, shape)
        mesh = dr.gather(mi.UInt32, self._shapes, number, active)
        known = active & (mesh != NO_MESH)
        if indexed:
            mesh += dr.select(instance != 0, hit.shape_index, 0)
        row = dr.gather(mi.Vector2u, self._meshes, mesh, known)
        return row.x, row.y, known

    def corners(self, face: Any, active: Any) -> tuple[Any, Any, Any]:
        """Return a face's three vertices, its material's number, and if it is smooth."""
        four = dr.gather(mi.Vector4u, self._corners, face, active)
        return mi.Vector3u(four.x, four.y, four.z), four.w & (_SMOOTH - 1), (four.w & _SMOOTH) != 0

    def row(self, material: Any, active: Any) -> tuple[Any, Any, Any]:
        """Return a material's twelve numbers as three vectors."""
        gathered = [dr.gather(mi.Vector4f, self._rows, 3 * material + k, active) for k in range(3)]
        return gathered[0], gathered[1], gathered[2]

    def looks(self, face: Any, active: Any) -> Any:
        """Return a face's colour and roughness, four numbers."""
        return dr.gather(mi.Vector4f, self._looks, face, active)

    def metallic(self, face: Any, active: Any) -> Any:
        """Return how metallic a face is, in [0, 1]."""
        return dr.gather(mi.Float, self._metals, face, active)

    def wear(self, corners: Any, weights: Any, active: Any) -> Any:
        """Return how worn and painted a point is, a colour, by its corners and their weights."""
        last = dr.width(self._wear) // 4 - 1
        at = [
            dr.gather(mi.Vector4f, self._wear, dr.minimum(corners[k], last), active)
            for k in range(3)
        ]
        mixed = at[0] * weights[0] + at[1] * weights[1] + at[2] * weights[2]
        inside = corners[0] <= last
        wear = dr.select(inside, mi.Color3f(mixed.x, mixed.y, mixed.z), mi.Color3f(*UNWORN))
        return dr.clip(wear, 0.0, 1.0)

    def instance(self, hit: Any, active: Any) -> tuple[Any, Any, Any]:
        """Return the matrix of the instance that was hit, its paint, and if there is one."""
        number = dr.reinterpret_array(mi.UInt32, hit.instance)
        there = active & (number != 0)
        rows = [dr.gather(mi.Vector4f, self._instances, 4 * number + k, there) for k in range(4)]
        paint, last = mi.Color3f(rows[3].x, rows[3].y, rows[3].z), rows[3].w
        told = dr.floor((last - dr.floor(last)) * (_FLOPS * _USES))
        flop = dr.floor(told * (1.0 / _USES))
        use = (told - _USES * flop + 0.5) * (1.0 / _USES)
        return rows[:3], Paint(paint, flop * (1.0 / (_FLOPS - 1)), use), there


def _fraction(flop: float, use: float) -> float:
    """Return what an instance's flop and use, in [0, 1] and [0, 1), add to its number."""
    return (round(flop * (_FLOPS - 1)) * _USES + int(use * _USES) + 0.5) / (_FLOPS * _USES)


def _laid_out(meshes: Iterable[HeldMesh], parameters: Any) -> list[_Place]:
    """Put meshes one after the other."""
    places: list[_Place] = []
    vertex = face = 0
    for mesh in meshes:
        vertices = len(parameters[f"{mesh.name}.vertex_positions"]) // 3
        faces = len(parameters[f"{mesh.name}.faces"]) // 3
        smooth = len(parameters[f"{mesh.name}.vertex_normals"]) == 3 * vertices
        places.append(_Place(mesh, vertex, vertices, face, faces, smooth))
        vertex, face = vertex + vertices, face + faces
    return places


def _looks(parameters: Any, name: str, row: Row, faces: int) -> Floats:
    """Return colour and roughness of a mesh's faces, (faces, 4)."""
    looks = np.tile([*row.colour, row.roughness], (faces, 1))
    tint = f"{name}.{TINT_ATTRIBUTE}"
    if tint in parameters and MaterialKind.TINTED in row.kind:
        looks[:, :3] = _array(parameters, tint, 3)
    own = slice(0, faces)
    looks[:, 3] = _by_face(parameters, f"{name}.{ROUGHNESS_ATTRIBUTE}", row.roughness, own)
    return looks


def _by_face(parameters: Any, key: str, plain: float, faces: slice) -> Floats:
    """Return a number for each face of a slice, the same for all where there is no attribute."""
    if key in parameters:
        return np.asarray(parameters[key], dtype=np.float64)
    return np.full(faces.stop - faces.start, plain)


def _array(parameters: Mapping[str, Any], key: str, width: int) -> Any:
    """Return a parameter as rows of some width."""
    return np.asarray(parameters[key]).reshape(-1, width)


def _number(shape: Any) -> int:
    """Return Mitsuba's number of a shape."""
    return int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])


def _own(values: Any, kind: Any = None, of: Any = np.float32) -> Any:
    """Return a flat copy in Dr.Jit's own memory, which may be written later."""
    kind = mi.Float if kind is None else kind
    source = kind(in_place(np.asarray(values), of))
    target = dr.empty(kind, len(source))
    dr.scatter(target, source, dr.arange(mi.UInt32, len(source)))
    dr.eval(target)
    return target


def _copy(target: Any, source: Any, first: int) -> None:
    """Write triples over the first three of four numbers, from a row of the target on."""
    index = dr.arange(mi.UInt32, len(source))
    row = index // 3
    start = dr.opaque(mi.UInt32, first)
    dr.scatter(target, source, 4 * (start + row) + (index - 3 * row))


Run = tuple[str, int]


@dataclass(frozen=True, slots=True, eq=False)
class Owners:
    """Which things faces belong to.

    Attributes:
        names: Of things that stand, and of parts of road users; the first is empty.
        starts: The first face of each run, (n,), increasing.
        owner: Number of the name of each run, (n,).
        of_instance: Number of the name that an instance shows, by Mitsuba's number of it, (k,).
        windswept: First face and number of faces of each mesh that wind moves, by its name.
    """

    names: tuple[str, ...]
    starts: Ints
    owner: Ints
    of_instance: Ints
    windswept: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def of(self, depth: Image, face: Image, instance: Image) -> Ints:
        """Return the number of the name at each pixel; 0 where there is none.

        Args:
            depth: 0 where nothing was met, (h, w).
            face: Number in the tables, (h, w).
            instance: Mitsuba's number of the instance, or 0, (h, w).
        """
        run = np.searchsorted(self.starts, face, side="right") - 1
        owner = self.owner[np.maximum(run, 0)]
        by_slot = self.of_instance[np.minimum(instance, len(self.of_instance) - 1)]
        return np.where(depth > 0.0, np.where(instance > 0, by_slot, owner), 0)

    def own_faces(self, face: Image) -> Ints:
        """Return numbers of faces, (n,), among those of the part that they belong to."""
        run = np.searchsorted(self.starts, face, side="right") - 1
        return np.asarray(face.astype(np.int64) - self.starts[run])


def owners_of(tables: Tables, loaded: LoadedScene) -> Owners:
    """Find which things the faces of a loaded scene belong to, in the frame that it shows.

    Args:
        tables: Of the scene, at that frame.
        loaded: The scene.
    """
    numbers = {"": 0}
    starts, owner = [0], [0]
    windswept: dict[str, tuple[int, int]] = {}
    for first, name, faces in tables.meshes():
        at = first
        if loaded.plants(name) is not None:
            windswept[name] = (first, faces)
        for thing, count in _runs(loaded, name, faces):
            starts.append(at)
            owner.append(numbers.setdefault(thing, len(numbers)))
            at += count
    slots = {} if loaded.pool is None else loaded.pool.shown
    of_slot = {tables.number_of(slot): name for slot, name in slots.items()}
    of_instance = np.zeros(max(of_slot, default=0) + 1, np.int64)
    for number, name in of_slot.items():
        of_instance[number] = numbers.setdefault(name, len(numbers))
    return Owners(tuple(numbers), np.array(starts), np.array(owner), of_instance, windswept)


def _runs(loaded: LoadedScene, mesh: str, faces: int) -> Iterator[Run]:
    """Yield what the faces of a mesh belong to, in their order."""
    shown: Mapping[str, slice] | None = loaded.shown.get(mesh)
    if shown is None:
        yield from loaded.things(mesh) or (("", faces),)
        return
    at = 0
    for name, places in sorted(shown.items(), key=lambda item: item[1].start):
        yield "", places.start - at
        yield name, places.stop - places.start
        at = places.stop
    yield "", faces - at
