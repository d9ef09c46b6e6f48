"""Finds names in a scene file that nothing has: presets, surfaces, codecs, tone curves, cameras."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Job, LagrangianCamera
from sumo3dviz_pt.job.yaml12 import KeyPath

Unknown = tuple[KeyPath, str]
"""Where a name stands, and what is wrong with it."""


def unknown_names(job: Job) -> Iterator[Unknown]:
    """Yield every name of a job that nothing has; nothing heavy is loaded for it."""
    from sumo3dviz_pt.image.tonemap import TONES
    from sumo3dviz_pt.video.codecs import AUTO, CODECS

    named: list[tuple[KeyPath, str, Collection[str], str]] = [
        (("quality",), job.quality, catalog.template_names("quality"), "quality preset"),
        (("output", "codec"), job.output.codec, (AUTO, *CODECS), "codec"),
        (("output", "tone"), job.output.tone, tuple(TONES), "tone curve"),
    ]
    if job.sky.preset is not None:
        skies = catalog.template_names("sky")
        named.append((("sky", "preset"), job.sky.preset, skies, "sky preset"))
    views = catalog.template_names("camera")
    named += [
        (("cameras", name, "view"), camera.view, views, "camera preset")
        for name, camera in job.cameras.items()
        if isinstance(camera, LagrangianCamera)
    ]
    named += [
        (("shots", index, "camera"), shot.camera, tuple(job.cameras), "camera")
        for index, shot in enumerate(job.shots)
    ]
    for path, surface in _surfaces(job):
        if not (surface.startswith("#") or Path(surface).suffix):
            named.append((path, surface, catalog.names("surfaces"), "surface"))
    for path, name, known, what in named:
        if name not in known:
            yield path, f"no {what} is called {name!r}{catalog.did_you_mean(name, known)}"
    yield from _unknown_looks(job)


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
