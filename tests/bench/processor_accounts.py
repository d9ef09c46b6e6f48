"""What there is in the library and in a scene, as arrays that two processors can compare.

An account maps names such as `sedan/full/paint/faces` to arrays. Whole numbers and words
decide what exists, floats where it lies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bakery.bake import bake_vehicle, completed_recipe, full_vehicle

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.library.mesh.shading import clustered_body
from sumo3dviz_pt.library.people.people import figure
from sumo3dviz_pt.library.plants.tree import LEVELS, tree
from sumo3dviz_pt.library.vehicles.interior.cutaway import cutaway
from sumo3dviz_pt.library.vehicles.plain_bodies import plain_body
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import FrameState, Mover, Part, Poses, Prototype
from sumo3dviz_pt.pipeline.production import Production, Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.proposals.proposal import propose
from sumo3dviz_pt.shot.showroom import exhibits
from sumo3dviz_pt.world.objects.houses import STYLES
from sumo3dviz_pt.world.objects.kinds import KINDS, PLANTS, TREE_VARIANTS

Account = dict[str, Any]

_RATE = 2.0  # frames a second of the shots that are looked at


def joined(prefix: str, account: Mapping[str, Any]) -> Account:
    """The same account under a longer name."""
    return {f"{prefix}/{key}": value for key, value in account.items()}


def mesh_account(mesh: Mesh) -> Account:
    """Which faces there are, and where."""
    own: Account = {"faces": mesh.faces, "vertices": mesh.vertices}
    for name in ("normals", "uvs", "wear"):
        values = getattr(mesh, name)
        own |= {} if values is None else {name: values}
    return own


def parts_account(parts: Sequence[Part]) -> Account:
    """Parts of a body."""
    account: Account = {"materials": np.array([part.material for part in parts], dtype=str)}
    for number, part in enumerate(parts):
        own = mesh_account(part.mesh)
        own |= {} if part.tint is None else {"tint": part.tint}
        account |= joined(f"{number}:{part.material}", own)
    return account


def meshes_account(meshes: Mapping[str, Mesh]) -> Account:
    """Meshes by material."""
    return {
        key: value
        for name, mesh in meshes.items()
        for key, value in joined(name, mesh_account(mesh)).items()
    }


def prototype_account(body: Prototype) -> Account:
    """Both levels of a body, its lamps and its poses."""
    account = joined("near", parts_account(body.parts)) | joined("far", parts_account(body.far))
    account["lamps/roles"] = np.array([lamp.role for lamp in body.lamps], dtype=str)
    account["lamps/at"] = np.array([(*lamp.at, *lamp.size, lamp.yaw) for lamp in body.lamps])
    for name in ("poses", "far_poses"):
        account |= _poses_account(name, getattr(body, name))
    return account


def _poses_account(name: str, poses: Poses | None) -> Account:
    """Shapes that a body takes."""
    return (
        {}
        if poses is None
        else {f"{name}/vertices": poses.vertices, f"{name}/normals": poses.normals}
    )


# The library ---------------------------------------------------------------------------------


Made = Iterator[tuple[str, Callable[[], Account]]]
"""Names, and what makes the account of each."""


def library() -> Made:
    """Everything that our code models."""
    yield from _vehicles()
    for look in catalog.names("people"):
        yield f"people/{look}", partial(_person, look)
    for vclass in ("passenger", "bus", "truck", "bicycle", "ship", "pedestrian", "tram"):
        yield f"plain/{vclass}", partial(_plain, vclass)
    for kind in KINDS:
        for model in kind.models if kind.name in PLANTS else ():
            yield f"plants/{model}", partial(_plant, model)
        for model, style in STYLES.get(kind.name, {}).items():
            yield f"buildings/{kind.name}/{model}", partial(_building, style)
    yield "street", partial(_exhibited, "street")


def _vehicles() -> Made:
    """Vehicles at all levels, and fitted to a size."""
    for name in catalog.names("vehicles"):
        entry = catalog.find("vehicles", name)
        if "units" not in entry.meta:
            yield f"vehicles/{name}/baked", partial(_baked, entry.folder)
            if "full" in entry.meta:
                yield f"vehicles/{name}/full", partial(_full, entry.folder)
    for model in models_for({}):
        yield f"fitted/{model.name}", partial(_fitted, model)


def _baked(folder: Path) -> Account:
    """The levels that travel with the package, as the code makes them."""
    made = bake_vehicle(completed_recipe(folder))
    return prototype_account(Prototype("", _parts(made.parts), _parts(made.far), made.lamps))


def _parts(meshes: Mapping[str, Mesh]) -> tuple[Part, ...]:
    return tuple(Part(mesh, material) for material, mesh in meshes.items())


def _full(folder: Path) -> Account:
    """The level for close views."""
    made = full_vehicle(completed_recipe(folder))
    assert made is not None
    return joined("body", meshes_account(made.body)) | joined("wheel", meshes_account(made.wheel))


def _fitted(model: Any) -> Account:
    """A vehicle for a vType of a size of its own, opened, and as a crowd shows it."""
    size = tuple(factor * side for factor, side in zip((1.08, 1.03, 0.96), model.size, strict=True))
    body = build_body(ModelChoice(model, sorted(model.vclasses)[0], size), {})
    account = joined("body", prototype_account(body.prototype))
    if body.prototype.poses is None:
        far = clustered_body([part.mesh for part in body.prototype.far], 0.18)
        account |= joined("crowd", meshes_account({str(k): mesh for k, mesh in enumerate(far)}))
    if body.vclass == "passenger":
        cowl, eye = body.seat.cowl / body.scale, body.seat.eye / body.scale
        opened = cutaway(body.prototype, cowl=float(cowl[0]), belt=float(cowl[2]), eye=eye)
        account |= joined("cockpit", prototype_account(opened))
    return account


def _person(look: str) -> Account:
    """Somebody on foot at both levels, in all poses."""
    recipe = catalog.find("people", look).meta["recipe"]
    (parts, poses), (far, far_poses) = figure(recipe), figure(recipe, "far")
    return prototype_account(Prototype(look, parts, far, poses=poses, far_poses=far_poses))


def _plain(vclass: str) -> Account:
    """A plain body."""
    made = plain_body(vclass, length=5.1, width=1.9, height=1.7)
    return joined("near", parts_account(made.parts)) | joined("far", parts_account(made.far))


def _plant(species: str) -> Account:
    """All levels and variants of a tree or shrub."""
    account: Account = {}
    for level in range(LEVELS):
        for variant in range(TREE_VARIANTS if level else 1):
            made = parts_account(tree(species, seed=variant, level=level))
            account |= joined(f"{level}.{variant}", made)
    return account


def _building(style: Any) -> Account:
    """All levels and variants of a building."""
    return {
        f"{level}.{variant}/{role}": quads
        for level in range(3)
        for variant in range(style.variants)
        for role, quads in style.build(variant, level).items()
    }


def _exhibited(family: str) -> Account:
    """A family of the showroom."""
    account: Account = {}
    for shown in exhibits(family):
        account |= joined(shown.title, parts_account(shown.parts))
    return account


# Scenes --------------------------------------------------------------------------------------


def scene_file(folder: Path, into: Path) -> Path:
    """A scene file that `init` writes for a folder of SUMO's files."""
    path = into / f"{folder.name}.yaml"
    text, _ = propose(folder, output=path, template="city_day")
    path.write_text(text, encoding="utf-8")
    return path


def scene(path: Path) -> Made:
    """World and plan of every shot of a scene file."""
    job = load_job(path)
    for number, shot in enumerate(job.shots):
        times = frame_times(shot.start, shot.end, _RATE)
        request = Request(camera=shot.camera)
        name = (
            f"{path.parent.name if path.name == 'scene.yaml' else path.stem}/{number}_{shot.camera}"
        )
        yield name, partial(_shot, job, request, times)


def _shot(job: Job, request: Request, times: Floats) -> Account:
    """World and plan of a shot."""
    production = prepare(job, request, times)
    return joined("world", world(production)) | joined("plan", plan(production))


def world(production: Production) -> Account:
    """Everything of a shot that does not move, and the bodies of all that does."""
    data = production.shot.data
    account: Account = {
        "parts": np.array([part.id for part in data.static], dtype=str),
        "materials": np.array(sorted(data.materials), dtype=str),
        "left_out": np.array([f"{out.what}: {out.why}" for out in data.left_out], dtype=str),
    }
    for number, part in enumerate(data.static):
        own = parts_account([part.part])
        account |= joined(f"{number}:{part.id}", own)
    for name, body in data.prototypes.items():
        account |= joined(f"body {name}", prototype_account(body))
    for lamps in data.lamps:
        own = mesh_account(lamps.mesh) | {"lamp": lamps.lamp_of_face}
        own |= {"names": np.array(lamps.lamps, dtype=str)}
        account |= joined(f"lamps {lamps.id}", own)
    return account


def plan(production: Production) -> Account:
    """Who has which body and colour, and who is drawn how in some frames."""
    shot = production.shot
    account: Account = {
        "keys": np.array(shot.fleet.keys, dtype=str),
        "models": np.array([body.assembly.model for body in shot.fleet.bodies], dtype=str),
        "colours": np.array(shot.fleet.colours),
        "full_models": np.array(sorted(shot.full_models), dtype=str),
        "limit": np.array(shot.limit),
    }
    for level in ("near", "far", "deforming"):
        room = getattr(shot.data.slots, level)
        account[f"slots/{level}/names"] = np.array(list(room), dtype=str)
        account[f"slots/{level}/room"] = np.array(list(room.values()), dtype=np.int64)
    for time in production.times:
        account |= joined(f"{time:g}", frame_account(shot.frame_at(float(time))))
    return account


def frame_account(frame: FrameState) -> Account:
    """Who is drawn how in a frame."""
    account: Account = {"camera": frame.view.world_from_camera.matrix}
    for level in ("movers", "deforming", "far"):
        some: tuple[Mover, ...] = getattr(frame, level)
        account[f"{level}/ids"] = np.array([f"{m.id} {m.part} {m.prototype}" for m in some], str)
        account[f"{level}/lit"] = np.array([" ".join(sorted(m.lit)) for m in some], dtype=str)
        account[f"{level}/poses"] = np.array([m.world_from_body.matrix for m in some])
        account[f"{level}/phases"] = np.array([(m.phase, m.effort) for m in some])
    return account
