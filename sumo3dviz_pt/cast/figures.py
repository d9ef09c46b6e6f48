"""People as figures in all their poses, and where people sit in a body.

Figures on foot and on bicycles take long to build. So they are built once, then kept in the user's
cache under all that they depend on. A seat says where the driver's eye and the foot of the
windscreen are.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import logging
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.atomic import Files, read_folder, write_folder
from sumo3dviz_pt.library.people.people import figure
from sumo3dviz_pt.library.vehicles.cycles.pedalling import pedalling
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Part, Poses, Prototype

_LOG = logging.getLogger(__name__)

_DIGITS = 16  # of a digest
_LIFETIME = 30 * 86_400.0  # how long a body of another version stays [s]


def cache_folder(entry: catalog.Entry, family: str) -> Path:
    """Return where a body lies in the cache: its recipe and our code are in the name.

    Args:
        entry: Of the catalogue.
        family: Such as `vehicles`.
    """
    digest = hashlib.blake2b(catalog.code_digest("library"), digest_size=_DIGITS // 2)
    for path in catalog.recipe_files(entry):
        digest.update(path.read_bytes())
    return catalog.cache_root() / family / f"{entry.name}-{digest.hexdigest()}"


def cached_files(folder: Path, build: Callable[[], Files]) -> Files:
    """Return a body's files from the cache; build and keep them if they are not whole.

    Args:
        folder: From `cache_folder`.
        build: Makes the files.
    """
    files = read_folder(folder)
    if files is None:
        files = build()
        try:
            write_folder(folder, files)
            _forget(folder)
        except OSError as error:
            _say_uncached(folder.parent, error.strerror or str(error))
    return files


@cache
def _say_uncached(root: Path, why: str) -> None:
    """Say once that nothing can be kept."""
    _LOG.warning(
        "%s cannot be written (%s): bodies are built anew each time;"
        " SUMO3DVIZ_PT_CACHE names another folder for them",
        root,
        why,
    )


def _forget(target: Path) -> None:
    """Remove what older recipes, older code or killed processes left; younger may be in use."""
    name = target.name[: -_DIGITS - 1]
    left = [*target.parent.glob(f"{name}-{'?' * _DIGITS}"), *target.parent.glob(".b*-*")]
    for folder in left:
        # Another process may have been faster.
        with contextlib.suppress(FileNotFoundError):
            if folder != target and time.time() - folder.stat().st_mtime > _LIFETIME:
                shutil.rmtree(folder, ignore_errors=True)


Posed = tuple[tuple[Part, ...], Poses]
"""Parts, and the shapes that they take in turn."""


@cache
def person(look: str) -> Prototype:
    """Return somebody on foot at both levels of detail; a process reads each once.

    Args:
        look: A name in the catalogue's family `people`.
    """
    entry = catalog.find("people", look)
    recipe = entry.meta["recipe"]
    made = {"near": lambda: figure(recipe), "far": lambda: figure(recipe, "far")}
    levels = _cached(entry, "people", made)
    (parts, poses), (far, far_poses) = levels["near"], levels["far"]
    return Prototype(look, parts, far, poses=poses, far_poses=far_poses)


def cyclist(entry: catalog.Entry) -> Posed:
    """Return a vehicle whose rider pedals, in detail.

    Args:
        entry: Of the catalogue's family `vehicles`.
    """
    return _cached(entry, "riders", {"near": lambda: pedalling(entry.meta)})["near"]


def _cached(
    entry: catalog.Entry, family: str, made: Mapping[str, Callable[[], Posed]]
) -> dict[str, Posed]:
    """Return levels of detail by their names, from the cache if they are there."""

    def build() -> Files:
        """Build all levels, as files."""
        return {f"{name}.npz": _written(*make()) for name, make in made.items()}

    files = cached_files(cache_folder(entry, family), build)
    return {name: _read(files[f"{name}.npz"]) for name in made}


def _written(parts: tuple[Part, ...], poses: Poses) -> bytes:
    """Return one level as the bytes of a NumPy archive."""
    arrays: dict[str, Any] = {
        "materials": np.array([part.material for part in parts]),
        "roles": np.array([part.role for part in parts]),
        "pose_vertices": poses.vertices,
        "pose_normals": poses.normals,
    }
    for number, part in enumerate(parts):
        mesh = part.mesh
        optional = {"normals": mesh.normals, "uvs": mesh.uvs, "tint": part.tint}
        arrays |= {f"{number}/vertices": mesh.vertices, f"{number}/faces": mesh.faces}
        arrays |= {f"{number}/{key}": some for key, some in optional.items() if some is not None}
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def _read(content: bytes) -> Posed:
    """Read one level that `_written` wrote."""
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        arrays: Mapping[str, Any] = dict(archive)
    parts, roles = [], arrays["roles"].tolist()
    for number, material in enumerate(arrays["materials"].tolist()):
        own = {key: arrays.get(f"{number}/{key}") for key in ("normals", "uvs", "tint")}
        mesh = Mesh(
            arrays[f"{number}/vertices"], arrays[f"{number}/faces"], own["normals"], own["uvs"]
        )
        parts.append(Part(mesh, str(material), own["tint"], roles[number]))
    return tuple(parts), Poses(arrays["pose_vertices"], arrays["pose_normals"])


CAR_EYE_HEIGHT = 1.2
"""Of a car driver, above the ground [m]; higher where the windscreen's foot is."""

_ABOVE_COWL = 0.25
"""A driver looks over the windscreen's foot by at least this [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Seat:
    """Places in the frame of a drawn body (+x forward, origin below the front).

    Attributes:
        eye: The eye on the left front seat, y >= 0, (3,) [m].
        cowl: Where bonnet and windscreen meet, on the axis, (3,) [m].
    """

    eye: Floats
    cowl: Floats


@dataclass(frozen=True, slots=True)
class _Rule:
    """A seat by class: metres, or shares of the body's size where marked.

    Attributes:
        back: Eye behind the front [m]; None is 0.45 of the length.
        aside: Eye left of the axis, share of the width.
        up: Eye above the ground [m]; None is 0.93 of the height.
        bonnet: Windscreen's foot behind the front [m].
        dash: Its height [m].
    """

    back: float | None
    aside: float
    up: float | None
    bonnet: float
    dash: float


_TRUCK = _Rule(1.2, 0.28, 2.3, 0.0, 1.35)
_BUS = _Rule(1.3, 0.30, 2.3, 0.0, 1.15)
_VAN = _Rule(1.9, 0.22, 1.75, 0.95, 1.25)
_TRAIN = _Rule(1.6, 0.0, 2.3, 0.0, 1.3)
_CYCLE = _Rule(None, 0.0, 1.5, 0.0, 1.0)
_SHIP = _Rule(None, 0.0, None, 0.0, 1.0)

_RULES: Mapping[str, _Rule] = {
    "truck": _TRUCK,
    "trailer": _TRUCK,
    "container": _TRUCK,
    "bus": _BUS,
    "coach": _BUS,
    "delivery": _VAN,
    "emergency": _VAN,
    **dict.fromkeys(
        ("tram", "rail", "rail_urban", "rail_electric", "rail_fast", "subway", "cable_car"), _TRAIN
    ),
    **dict.fromkeys(("motorcycle", "moped", "bicycle", "scooter", "wheelchair"), _CYCLE),
    "pedestrian": _Rule(0.1, 0.0, None, 0.0, 1.0),
    "ship": _SHIP,
    "aircraft": _SHIP,
}

PLAIN_CLASSES = frozenset(_RULES)
"""Classes with a seat of their own kind."""


def class_seat(vclass: str, size: Floats) -> Seat:
    """Return the seat in a plain body.

    Args:
        vclass: What is drawn.
        size: Length, width, height, (3,) [m].
    """
    length, width, height = (float(side) for side in size)
    rule = _RULES.get(vclass)
    if rule is None:
        cowl = np.array([-0.24 * length, 0.0, 0.64 * height])
        return car_seat(np.array([-0.45 * length, 0.2 * width, 0.0]), cowl=cowl)
    back = 0.45 * length if rule.back is None else min(rule.back, 0.5 * length)
    up = 0.93 * height if rule.up is None else rule.up
    if width > 1.2:
        up = min(up, 0.97 * height)
    cowl = np.array([-min(rule.bonnet, 0.3 * length), 0.0, min(rule.dash, 0.7 * height)])
    return Seat(np.array([-back, rule.aside * width, up]), cowl)


def car_seat(eye: Floats, *, cowl: Floats) -> Seat:
    """Return the seat in a car whose eye point and windscreen's foot are known, (3,) each [m].

    The eye is 1.2 m above the ground, or higher where it could not look over the bonnet.
    """
    height = max(CAR_EYE_HEIGHT, float(cowl[2]) + _ABOVE_COWL)
    return Seat(np.array([eye[0], abs(eye[1]), height]), cowl)
