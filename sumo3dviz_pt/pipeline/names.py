"""Finds names in a scene file that nothing has: presets, surfaces, codecs, tone curves, cameras."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Job, LagrangianCamera
from sumo3dviz_pt.job.yaml12 import KeyPath
from sumo3dviz_pt.pipeline.choices import names_for

Unknown = tuple[KeyPath, str]
"""Where a name stands, and what is wrong with it."""


@dataclass(frozen=True, slots=True)
class _Named:
    """A name that a setting refers to.

    Attributes:
        path: Where it stands.
        name: The name itself.
        what: What it should be the name of.
        known: All names of such things.
    """

    path: KeyPath
    name: str
    what: str
    known: Collection[str]


def unknown_names(job: Job) -> Iterator[Unknown]:
    """Yield every name of a job that nothing has; nothing heavy is loaded for it."""
    for named in _named(job):
        if named.name not in named.known:
            hint = catalog.did_you_mean(named.name, named.known)
            yield named.path, f"no {named.what} is called {named.name!r}{hint}"
    yield from _unknown_looks(job)


def _named(job: Job) -> Iterator[_Named]:
    """Yield all names but those of vehicles and people."""
    yield _Named(("quality",), job.quality, "quality preset", names_for("quality"))
    yield _Named(("output", "codec"), job.output.codec, "codec", names_for("output.codec"))
    yield _Named(("output", "tone"), job.output.tone, "tone curve", names_for("output.tone"))
    yield from _presets(job)
    classes = names_for("vehicles.types.NAME") if job.vehicles.types else ()
    for type_id, vclass in job.vehicles.types.items():
        yield _Named(("vehicles", "types", type_id), vclass, "vClass of SUMO", classes)
    for name, camera in job.cameras.items():
        if isinstance(camera, LagrangianCamera):
            views = names_for("cameras.NAME.view")
            yield _Named(("cameras", name, "view"), camera.view, "camera preset", views)
    for index, shot in enumerate(job.shots):
        yield _Named(("shots", index, "camera"), shot.camera, "camera", tuple(job.cameras))
    for path, surface in _surfaces(job):
        if not (surface.startswith("#") or Path(surface).suffix):
            yield _Named(path, surface, "surface", names_for("ground.texture"))


def _presets(job: Job) -> Iterator[_Named]:
    """Yield the names of presets of sky and weather."""
    for what, settings in (("sky", job.sky), ("weather", job.weather)):
        if settings is not None and settings.preset is not None:
            known = names_for(f"{what}.preset")
            yield _Named((what, "preset"), settings.preset, f"{what} preset", known)


def _unknown_looks(job: Job) -> Iterator[Unknown]:
    """Yield the models that are given to single road users and do not exist."""
    vehicles, people = catalog.names("vehicles"), catalog.names("people")
    for pattern, look in job.vehicles.by_id.items():
        place, name = ("vehicles", "by_id", pattern, "model"), look.model
        if name is not None and name not in (*vehicles, *people):
            hint = catalog.did_you_mean(name, (*vehicles, *people))
            yield place, f"no model of a vehicle or person is called {name!r}{hint}"
        if name in vehicles and not catalog.find("vehicles", name).meta.get("vclass", True):
            yield place, f"{name!r} is only a part of other vehicles"


def _surfaces(job: Job) -> Iterator[tuple[KeyPath, str]]:
    """Yield where surfaces are named, and which."""
    yield ("ground", "texture"), job.ground.texture
    yield ("roads", "surface"), job.roads.surface
    for pattern, style in job.roads.per_edge.items():
        if style.surface is not None:
            yield ("roads", "per_edge", pattern, "surface"), style.surface
