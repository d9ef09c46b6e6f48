"""Checks what a scene file chooses for its look, before anything is built."""

from __future__ import annotations

from pathlib import Path

from sumo3dviz_pt.cast.choice import looks_for, models_for
from sumo3dviz_pt.cast.colours import own_palette
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.library.materials.by_key import check_surface
from sumo3dviz_pt.library.skies.radiance_maps import check_radiance_file
from sumo3dviz_pt.library.vehicles.user_mesh import check_user_file
from sumo3dviz_pt.world.objects.kinds import KINDS, check_settings
from sumo3dviz_pt.world.sky.build import check_sky


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
