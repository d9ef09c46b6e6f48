"""Keeps built places in the user's cache, so that the next command need not build them again.

A cached place lies under all that it depends on: what its world is made from, our own code, and the
camera's path. Nothing but values comes out of it (see `files.values`): what somebody else may have
laid there runs no code.
"""

from __future__ import annotations

import contextlib
import logging
import os
from dataclasses import replace
from functools import partial
from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.atomic import make_room, read_folder, write_folder
from sumo3dviz_pt.files.values import kinds_in, packed, unpacked
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.world.build import BuiltPlace, World, build_place
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.outlook import Outlook, seen_of
from sumo3dviz_pt.world.rails.tracks import RailHeight
from sumo3dviz_pt.world.roads.roads import WalkingHeight

log = logging.getLogger(__name__)

_LEAST = 100_000
"""Places of fewer triangles are built as quickly as they are loaded."""

_MOST = 2_000_000_000
"""Size of all cached places above which the oldest are removed [bytes]."""

_KINDS = kinds_in(BuiltPlace, WalkingHeight, RailHeight)
"""What a place may hold; annotations hide which classes tell its heights."""


def place_around(world: World, camera_path: CameraPath) -> BuiltPlace:
    """Return what stands around a camera's path: what was cached of it, or newly built.

    A world whose cameras share a place gives what this one sees of that, about.

    Args:
        world: What exists.
        camera_path: Where the camera is and looks.

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    outlook = world.outlook
    if outlook is not None and outlook.camera_path is not None:
        place = _shared(world, outlook, camera_path, together=outlook.camera_path)
    else:
        place = _cached(world, camera_path) if world.key else build_place(world, camera_path)
    for item in place.left_out:
        if item.surprising:
            log.warning("left out %s: %s", item.what, item.why)
    return place


def _cached(world: World, camera_path: CameraPath) -> BuiltPlace:
    """Return a place that was cached; or build it, and keep it if it is large."""
    folder = _folder(world, camera_path)
    cached = _cached_place(folder)
    if cached is not None:
        return cached
    place = build_place(world, camera_path)
    if sum(len(part.part.mesh.faces) for part in place.static) > _LEAST:
        _cache_place(folder, place)
    return place


def _shared(
    world: World, outlook: Outlook, camera_path: CameraPath, *, together: CameraPath
) -> BuiltPlace:
    """Return a camera's own place if one was cached, else its part of one that others share."""
    cached = _cached_place(_folder(world, camera_path)) if world.key else None
    if cached is not None:
        return cached
    make = partial(_cached if world.key else build_place, world, together)
    place = outlook.memory.of(("place",), make)
    lanes = len(world.scenario.network.lanes)
    return replace(place, static=seen_of(place.static, camera_path, lanes=lanes))


def _folder(world: World, camera_path: CameraPath) -> Path:
    """Return where a place is cached."""
    path = [camera_path.positions, camera_path.forwards, camera_path.half_angles]
    path += [each for each in (camera_path.parallel, camera_path.behind) if each is not None]
    return catalog.cache_root() / "places" / digest_of(world.key, *path).hex()


def _cached_place(folder: Path) -> BuiltPlace | None:
    """Return a cached place; None if it is not there, damaged or not of this kind."""
    files = read_folder(folder)
    if files is None:
        return None
    try:
        place = unpacked(files, _KINDS)
    except ValueError as error:
        log.info("%s: the place is built anew (%s)", folder, error)
        return None
    with contextlib.suppress(OSError):
        os.utime(folder)  # the oldest are removed first
    return place if isinstance(place, BuiltPlace) else None


def _cache_place(folder: Path, place: BuiltPlace) -> None:
    """Keep a place, and remove the oldest ones if there are too many."""
    try:
        write_folder(folder, packed(place, _KINDS))
        make_room(folder, _MOST)
    except (OSError, TypeError) as error:
        log.info("%s: the place is not kept (%s)", folder, error)
