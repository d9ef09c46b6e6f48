"""What a shot draws: which road users, how, and with room for the most at once.

Drawn is what a camera sees, or what casts light into its picture. Everything here is a pure
function of the whole shot, never of what was rendered before, so that any part of a film can be
rendered alone. The renderer's slots, so many for each kind of body, are fixed before the first
frame, so that nothing compiles later and no frame can run out of them. Stand-ins are as coarse as
the budget asks.

What a scene file chooses for its look is checked before anything is built. Also told is what of a
scene a shot uses, and what is absent.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.cast.choice import looks_for, models_for
from sumo3dviz_pt.cast.colours import own_palette
from sumo3dviz_pt.cast.drawing import Drawn
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.library.materials import check_surface
from sumo3dviz_pt.library.mesh.shading import clustered_body
from sumo3dviz_pt.library.pictures import check_radiance_file
from sumo3dviz_pt.library.vehicles.user_mesh import check_user_file
from sumo3dviz_pt.model.camera import CameraPath, in_picture, in_view
from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.scene import Bsdf, LeftOut, Part, Prototype, Slots
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.world.build import BuiltPlace
from sumo3dviz_pt.world.objects.kinds import KINDS, check_settings
from sumo3dviz_pt.world.sky import check_sky


def check_scene_choices(job: Job) -> None:
    """Refuse models, colours, surfaces and files that are not there.

    Raises:
        ConfigError: Names the key; suggests a name.
        InputError: If a radiance map is missing or of an unknown kind.
    """
    _check_sky(job)
    for key, surface in _surfaces(job):
        try:
            check_surface(surface)
        except ConfigError as error:
            raise ConfigError(str(error), key=key) from error
    wanted = dict(job.vehicles.models)
    looks_for(wanted.pop("pedestrian", ()))
    models_for({**wanted, "passenger": job.vehicles.passenger})
    if not isinstance(job.vehicles.colours, str):
        own_palette(job.vehicles.colours)
    for path in job.vehicles.user_models.values():
        check_user_file(path)
    for kind in KINDS:
        settings = getattr(job.objects, kind.name)
        if settings is not None:
            check_settings(kind, settings)


def _check_sky(job: Job) -> None:
    """Refuse a sky that contradicts itself or whose map is not there."""
    check_sky(job.sky)
    if job.sky.file is not None:
        check_radiance_file(job.sky.file)


def _surfaces(job: Job) -> list[tuple[str, str]]:
    """Keys and names of all surfaces that are chosen."""
    chosen = [("ground.texture", job.ground.texture), ("roads.surface", job.roads.surface)]
    for pattern, style in job.roads.per_edge.items():
        if style.surface is not None:
            chosen.append((f"roads.per_edge.{pattern}.surface", style.surface))
    return [(key, name) for key, name in chosen if Path(name).suffix or name.startswith("#")]


FAR_END = 3000.0
"""Road users farther than this are smaller than a pixel in haze [m]."""

NEAR_END = 250.0
"""Farther road users are drawn by their stand-ins, through a lens of 50 degrees or wider [m]."""

FULL_END = 32.0
"""Nearer road users are drawn in full detail through a lens of 50 degrees [m]."""

_LENS = float(np.tan(np.radians(25.0)) * np.hypot(1.0, 9 / 16))
_LONGEST = 14.0  # reach of most bodies from their front bumper [m]
_SHADOW = 40.0  # reach of most bodies and, at most hours, their shadows [m]
_CAST = 25.0  # reach of shadows beyond the rear of longer bodies [m]

MOST_NEAR = 120
"""Road users in detail in one frame, at most."""

MOST_FULL = 16
"""Road users in full detail in one frame, at most: wheels are parts of their own."""

MOST_LETTERED = 24
"""Road users whose number plates can be read in one frame, at most."""

_LEGIBLE = 1.5
"""Plates can be read up to this many times as far as there is full detail: farther letters are
lower than three pixels of a picture 1920 wide."""

_CHUNK = 200


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """How road users are drawn, (k, n) each; each in one way at most.

    Attributes:
        near: In detail.
        far: By their stand-ins.
        full: In full detail.
        lettered: With number plates that can be read, near or in full detail.
    """

    near: Bools
    far: Bools
    full: Bools
    lettered: Bools

    def coarser(self, distant: Bools) -> Choice:
        """Return the same, but some of the k road users by stand-ins where they are drawn."""
        rest = ~distant[:, None]
        far = self.far | ((self.near | self.full) & ~rest)
        return Choice(self.near & rest, far, self.full & rest, self.lettered & rest)


def choose(
    camera_path: CameraPath,
    alive: Bools,
    positions: Floats,
    *,
    limit: int,
    can_be_full: Bools | None = None,
    lengths: Floats | None = None,
) -> Choice:
    """Choose the nearest visible road users for detail and the others for stand-ins.

    Args:
        camera_path: n times.
        alive: (k, n).
        positions: (k, n, 3) [m]; anything where not alive.
        limit: How many are drawn in detail at once, at most.
        can_be_full: Which road users can be drawn in full detail, (k,); None is none.
        lengths: Of their bodies, (k,) [m]: a train is seen long after its front; None is 0.
    """
    long = np.zeros(len(alive)) if lengths is None else lengths
    places = np.where(alive[..., None], positions, 1e9)
    # Measure distances; a long road user may be near although its front is not.
    beyond = np.maximum(long - _LONGEST, 0.0)[:, None]
    distance = settled(np.maximum(camera_path.away(places) - beyond, 0.0))
    reach = np.maximum(_SHADOW, long + _CAST)[:, None]
    # Choose levels from the coarsest to the finest.
    shown = alive & (distance < FAR_END) & in_view(camera_path, places, radius=reach)
    near = _nearest(distance, among=shown & (distance < near_end(camera_path)), limit=limit)
    full_end = _full_end(camera_path)
    close = near & (distance < _LEGIBLE * full_end)
    close &= in_picture(camera_path, places, radius=np.maximum(_LONGEST, long)[:, None])
    able = close & (distance < full_end)
    able &= False if can_be_full is None else can_be_full[:, None]
    full = _nearest(distance, among=able, limit=MOST_FULL)
    lettered = _nearest(distance, among=close, limit=MOST_LETTERED)
    return Choice(near & ~full, shown & ~near, full, lettered)


def _nearest(distance: Floats, *, among: Bools, limit: int) -> Bools:
    """The nearest few of those that qualify, at each time, (k, n)."""
    ranked = np.where(among, distance, np.inf)
    order = np.argsort(ranked, axis=0, kind="stable")
    rank = np.empty_like(order)
    np.put_along_axis(rank, order, np.arange(len(order))[:, None], axis=0)
    return np.asarray(among & (rank < limit))


def _full_end(camera_path: CameraPath) -> Floats:
    """Where full detail ends, (n,) [m]: a telephoto lens shows it from farther away."""
    return np.clip(FULL_END * _LENS / _slopes(camera_path), 12.0, 120.0)


def reach(length: float) -> float:
    """Return the radius around a front that holds a body of a length [m] and its shadow [m]."""
    return max(_SHADOW, length + _CAST)


def near_end(camera_path: CameraPath) -> Floats:
    """Return where the middle level ends, (n,) [m]: a telephoto lens shows it from farther away."""
    return np.clip(NEAR_END * _LENS / _slopes(camera_path), NEAR_END, 6.0 * NEAR_END)


def _slopes(camera_path: CameraPath) -> Floats:
    """Half the diagonal of what cameras show one metre ahead, (n,) [m]; infinite all around."""
    narrow = camera_path.half_angles < np.pi / 2.0
    slopes = np.where(narrow, np.tan(np.where(narrow, camera_path.half_angles, 0.0)), np.inf)
    if camera_path.parallel is None:
        return slopes
    # How large things look through such a lens is measured by `CameraPath.away` already.
    return np.where(camera_path.parallel > 0.0, _LENS, slopes)


def chunks(count: int) -> Iterator[slice]:
    """Yield stretches of a shot of so many frames that fit into memory."""
    for first in range(0, count, _CHUNK):
        yield slice(first, min(first + _CHUNK, count))


MOST_SLOTS = 240
"""Instances in one scene; the cost of recording them grows faster than their number."""

MOST_FULL_MODELS = 8
"""Models in full detail in one shot, at most."""

FULL_TRIANGLES = 54_000
"""Of a car in full detail and one of its wheels: instances count once."""

FAR_TRIANGLES = 110_000
"""Of all stand-ins together; where there are many, they are coarser."""

SHOT_TRIANGLES = 1_450_000
"""Of a whole shot: every update of poses rebuilds the trees over all of them."""


class CrowdFrames(NamedTuple):
    """Cameras and road users in some frames of a shot.

    Attributes:
        camera_path: Where the camera is and looks, in n frames.
        alive: Whether each of k road users exists, (k, n).
        positions: Their fronts, (k, n, 3) [m]; NaN where they do not exist.
    """

    camera_path: CameraPath
    alive: Bools
    positions: Floats


@dataclass(frozen=True, slots=True)
class CrowdPlan:
    """How a shot draws its road users.

    Attributes:
        slots: Room for each body.
        limit: Road users in detail in one frame, at most.
        full_models: Models that are drawn in full detail where they are near enough.
    """

    slots: Slots
    limit: int
    full_models: frozenset[str] = frozenset()


def plan_crowd(
    bodies: Sequence[Drawn],
    frames: Sequence[CrowdFrames],
    *,
    triangles: Mapping[str, int] | None = None,
    budget: int = SHOT_TRIANGLES,
    limit: int = MOST_NEAR,
    full: int | None = None,
) -> CrowdPlan:
    """Find how many bodies of each kind a shot shows at once.

    Args:
        bodies: Of each of the k road users.
        frames: The whole shot.
        triangles: Of each prototype in detail.
        budget: Triangles of all road users; full detail gets what the others leave.
        limit: Road users in detail at once, at most.
        full: Models in full detail, at most, whatever the budget; None is what it leaves.
    """
    plain = _slots(bodies, frames, limit=limit, able=np.zeros(len(bodies), dtype=np.bool_))
    most = _most_full(plain, triangles or {}, budget) if full is None else full
    full_models = _full_models(bodies, frames, most=most)
    able = can_be_full(bodies, full_models)
    while True:
        slots = _slots(bodies, frames, limit=limit, able=able)
        if sum(slots.near.values()) <= MOST_SLOTS or limit <= 8:
            return CrowdPlan(slots, limit, full_models)
        limit = limit * 3 // 4


def can_be_full(bodies: Sequence[Drawn], full_models: frozenset[str]) -> Bools:
    """Return which road users can be drawn in full detail, (k,)."""
    return np.array(
        [bool(body.full) and body.model in full_models for body in bodies], dtype=np.bool_
    )


def fitting(choice: Choice, bodies: Sequence[Drawn], slots: Slots, distances: Floats) -> Choice:
    """Return how road users are drawn in a scene whose slots were planned for other views.

    The nearest get room first. Those without room in detail are drawn by stand-ins, and those
    without any room are not drawn.

    Args:
        choice: What is wanted at one time, (k, 1) each.
        bodies: Of each of the k road users.
        slots: The room that there is.
        distances: From the camera, (k,) [m].
    """
    # Hand out the slots, each road user's finest level first.
    detailed, distant = Counter(slots.detailed), Counter(slots.far)
    levels_found = ("full", "near", "far", "lettered")
    masks = {level: np.zeros_like(choice.near) for level in levels_found}
    wanted = choice.near | choice.full | choice.far
    for k in sorted(np.flatnonzero(wanted[:, 0]).tolist(), key=lambda k: float(distances[k])):
        body = bodies[k]
        levels = [("far", body.far, distant)]
        if not choice.far[k, 0]:
            levels.insert(0, ("near", (*body.near, *body.deforming), detailed))
        if choice.full[k, 0]:
            levels.insert(0, ("full", (*body.full, *body.deforming), detailed))
        for level, names, room in levels:
            needed = Counter(names)
            if needed <= room:
                room.subtract(needed)
                masks[level][k] = True
                wished = Counter(body.letters if choice.lettered[k, 0] and level != "far" else ())
                if wished and wished <= detailed:
                    detailed.subtract(wished)
                    masks["lettered"][k] = True
                break
    return Choice(**masks)


def lengths_of(bodies: Sequence[Drawn]) -> Floats:
    """Return the lengths of bodies, (k,) [m]."""
    return np.array([body.length for body in bodies], dtype=np.float64)


def _most_full(slots: Slots, triangles: Mapping[str, int], budget: int) -> int:
    """How many models in full detail the budget allows: instances count once."""
    detailed = sum(triangles.get(name, 0) for name in slots.near)
    detailed += sum(count * triangles.get(name, 0) for name, count in slots.deforming.items())
    spare = budget - FAR_TRIANGLES - detailed
    return int(np.clip(spare // FULL_TRIANGLES, 1, MOST_FULL_MODELS))


def _full_models(
    bodies: Sequence[Drawn], frames: Sequence[CrowdFrames], *, most: int
) -> frozenset[str]:
    """The models that are near enough for full detail in most frames."""
    able = np.array([bool(body.full) for body in bodies], dtype=np.bool_)
    seen: Counter[str] = Counter()
    for camera_path, alive, positions in frames:
        choice = choose(
            camera_path,
            alive,
            positions,
            limit=MOST_NEAR,
            can_be_full=able,
            lengths=lengths_of(bodies),
        )
        for k in np.flatnonzero(choice.full.any(axis=1)).tolist():
            seen[bodies[k].model] += int(choice.full[k].sum())
    ranked = sorted(seen, key=lambda model: (-seen[model], model))
    return frozenset(ranked[:most])


def _slots(
    bodies: Sequence[Drawn], frames: Sequence[CrowdFrames], *, limit: int, able: Bools
) -> Slots:
    """The most bodies of each kind at once."""
    near, far, full, moving, letters = (
        _Members.of([getattr(body, level) for body in bodies])
        for level in ("near", "far", "full", "deforming", "letters")
    )
    lengths = lengths_of(bodies)
    rigid: Counter[str] = Counter()
    deforming: Counter[str] = Counter()
    distant: Counter[str] = Counter()
    instanced: Counter[str] = Counter()
    for camera_path, alive, positions in frames:
        choice: Choice = choose(
            camera_path, alive, positions, limit=limit, can_be_full=able, lengths=lengths
        )
        rigid |= near.most(choice.near)
        deforming |= moving.most(choice.near | choice.full) | letters.most(choice.lettered)
        distant |= far.most(choice.far)
        instanced |= full.most(choice.full)
    return Slots(_sorted(rigid + instanced), _sorted(distant), _sorted(deforming))


@dataclass(frozen=True, slots=True, eq=False)
class _Members:
    """How many bodies of each prototype road users are drawn with.

    Attributes:
        names: Of the m prototypes.
        counts: Of each prototype for each road user, (m, k).
    """

    names: tuple[str, ...]
    counts: Floats

    @classmethod
    def of(cls, drawn: Sequence[tuple[str, ...]]) -> _Members:
        """Count the names of the prototypes of each road user."""
        names = sorted({name for some in drawn for name in some})
        index = {name: row for row, name in enumerate(names)}
        counts = np.zeros((len(names), len(drawn)))
        for column, some in enumerate(drawn):
            for name in some:
                counts[index[name], column] += 1.0
        return cls(tuple(names), counts)

    def most(self, chosen: Bools) -> Counter[str]:
        """Most bodies at once, by name, where the road users are chosen, (k, n)."""
        if not chosen.any():
            return Counter()
        # Only users who are ever chosen, and frames whose users differ from the frame before.
        users = np.flatnonzero(chosen.any(axis=1))
        some = chosen[users]
        other = (some[:, 1:] != some[:, :-1]).any(axis=0)
        most = (self.counts[:, users] @ some[:, np.append(True, other)]).max(axis=1)
        return Counter({name: int(n) for name, n in zip(self.names, most, strict=True) if n})


def _sorted(counts: Mapping[str, int]) -> dict[str, int]:
    """By name, so that the order of frames does not matter."""
    return {name: counts[name] for name in sorted(counts)}


_CELLS = (0.08, 0.12, 0.18, 0.25, 0.35)
"""Cells in which vertices of stand-ins are merged, until there are few enough [m]."""


def shown_bodies(prototypes: Mapping[str, Prototype], slots: Slots) -> dict[str, Prototype]:
    """Return the bodies that have slots, with stand-ins coarse enough for their budget."""
    names = sorted({*slots.near, *slots.far, *slots.deforming})
    return _coarse_enough({name: prototypes[name] for name in names}, slots.far)


def _coarse_enough(
    prototypes: Mapping[str, Prototype], slots: Mapping[str, int]
) -> dict[str, Prototype]:
    """The same bodies with stand-ins so coarse that all of them keep their budget."""
    bodies = dict(prototypes)
    for cell in _CELLS:
        total = sum(count * _far_triangles(bodies[name]) for name, count in slots.items())
        if total <= FAR_TRIANGLES:
            break
        for name in slots:
            whole = prototypes[name]
            # Those that take poses keep their points.
            if whole.far_poses is None:
                bodies[name] = replace(whole, far=_coarser(whole.far, cell))
    return bodies


@lru_cache(maxsize=512)
def _coarser(parts: tuple[Part, ...], cell: float) -> tuple[Part, ...]:
    """Return a stand-in's parts with vertices merged in cells [m]; shots share most bodies."""
    meshes = clustered_body([part.mesh for part in parts], cell)
    coarse = (replace(p, mesh=m) for p, m in zip(parts, meshes, strict=True))
    return tuple(p for p in coarse if p.tint is None and len(p.mesh.faces)) or parts


def _far_triangles(prototype: Prototype) -> int:
    """Of its stand-in."""
    return sum(len(part.mesh.faces) for part in prototype.far)


def used_materials(
    place: BuiltPlace, prototypes: Collection[Prototype], own: Mapping[str, Bsdf]
) -> dict[str, Bsdf]:
    """Return the materials in use.

    Args:
        place: What stands.
        prototypes: Bodies that are shown.
        own: Materials of users' models.
    """
    used = {part.part.material for part in place.static}
    for prototype in prototypes:
        used |= {part.material for part in (*prototype.parts, *prototype.far)}
    if place.lamps or any(prototype.lamps for prototype in prototypes):
        used.add("signal_lens")
    known = {**place.materials, **own}
    return {name: known[name] for name in sorted(used)}


def absent_users(scenario: Scenario, fleet: Fleet, crowd: CrowdPlan) -> tuple[LeftOut, ...]:
    """Return which road users the log or the view does not have.

    Args:
        scenario: As read.
        fleet: Everyone on the road.
        crowd: How the shot draws them.
    """
    out = []
    kinds = {trace.kind for trace in scenario.traffic.traces}
    if "person" not in kinds:
        out.append(LeftOut("persons", "the log has none in this time"))
    slots = crowd.slots
    unused = sorted(set(fleet.prototypes) - {*slots.near, *slots.far, *slots.deforming})
    if unused:
        spared = sum(fleet.prototypes[name].triangles for name in unused)
        why = "no road user in view of the shot has them"
        out.append(LeftOut(f"{len(unused)} bodies", why, triangles=spared))
    return tuple(out)
