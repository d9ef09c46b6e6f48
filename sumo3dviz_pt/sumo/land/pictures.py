"""Reads what the land looks like from above, and lays it into the network's coordinates.

A picture is a GeoTIFF, one with a world file or given corners, or the decal of SUMO's view
settings. What is made of it lies in the user's cache, as a PNG whose edges follow the axes.
"""

from __future__ import annotations

import hashlib
import io
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import make_room, read_folder, write_folder
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import GroundPicture, Location, Network
from sumo3dviz_pt.model.traffic import LandFiles
from sumo3dviz_pt.sumo.find import CONFIGURATION_ROOTS
from sumo3dviz_pt.sumo.land.rasters import WORLD_FILES, placing_of, way_to, world_file
from sumo3dviz_pt.sumo.stream import may_be_xml, read_elements, root_of

_SIDE = 8192  # pixels of a picture's side, at most
_AROUND = 1500.0  # land that is kept around a network [m]
_MOST = 2_000_000_000
_PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
_NAME, _TIFF = "picture.png", (b"II", b"MM")

Box = tuple[float, float, float, float]


def picture_of(land: LandFiles, network: Network) -> GroundPicture | None:
    """Return what the land looks like from above; None where nothing tells it.

    Raises:
        InputError: If the file is damaged, says nowhere where it lies, or lies elsewhere.
        MissingExtraError: If its coordinates differ from the network's and pyproj is not there.
    """
    if land.picture is None:
        return None
    file, location = land.picture, network.location
    corners = land.corners
    if may_be_xml(file):
        file, corners = _decal(file)
    if corners is not None:
        (x0, y0), (x1, y1) = (location.inside([corner])[0] for corner in corners)
        if not (x0 < x1 and y0 < y1):
            message = "its corners should be the south-western and the north-eastern one"
            raise InputError(message, file=file)
        return GroundPicture(_kept(file, (x0, y0, x1, y1), None, location), (x0, y0, x1, y1))
    box = _box_around(network)
    return GroundPicture(_kept(file, box, box, location), box)


def view_with_picture(place: Path) -> Path | None:
    """Return view settings of SUMO that lay a picture on the land; None where none do.

    Args:
        place: A .sumocfg, which may name them, or a folder in which they, or it, may lie.
    """
    if place.is_dir():
        found = [file for file in sorted(place.glob("*.xml")) if root_of(file) == "viewsettings"]
        found += [own for each in sorted(place.glob("*.sumocfg")) for own in _views_of(each)]
    else:
        found = _views_of(place)
    for file in found:
        with suppress(InputError):
            if _decal(file)[0].is_file():
                return file
    return None


def pictures_beside(place: Path) -> list[Path]:
    """Return pictures whose world files lie beside a scenario.

    Args:
        place: A folder, or a file in it.
    """
    folder = place if place.is_dir() else place.parent
    named = {file.stem for file in folder.iterdir() if file.suffix.lower() in WORLD_FILES}
    files = (file for file in sorted(folder.iterdir()) if file.suffix.lower() in _PICTURES)
    return [file for file in files if file.stem in named]


def _views_of(configuration: Path) -> list[Path]:
    """Return the view settings that a configuration of SUMO names."""
    if root_of(configuration) not in CONFIGURATION_ROOTS:
        return []
    elements = read_elements(configuration, root=(), what="a configuration of SUMO")
    named = [each.text("value", "") for each in elements if each.tag == "gui-settings-file"]
    return [configuration.parent / name for name in named if name]


def _decal(file: Path) -> tuple[Path, tuple[tuple[float, float], tuple[float, float]]]:
    """Return the picture that view settings of SUMO name, and its corners [m]."""
    for element in read_elements(file, root=(), what="view settings of SUMO"):
        if element.tag == "decal":
            x, y = element.number("centerX", 0.0), element.number("centerY", 0.0)
            width, height = element.number("width", 100.0), element.number("height", 100.0)
            if element.number("rotation", 0.0):
                raise element.error("a decal that is turned cannot be laid; turn the picture")
            corners = (x - width / 2, y - height / 2), (x + width / 2, y + height / 2)
            name = element.attributes.get("file") or element.text("filename")
            return file.parent / name.replace("\\", "/"), corners
    raise InputError("has no decal; name a picture, or view settings with one", file=file)


def _box_around(network: Network) -> Box:
    """Return the box around all roads, and some land, in whole metres."""
    lanes = np.concatenate([lane.shape[:, :2] for lane in network.lanes.values()])
    low = np.floor(lanes.min(axis=0) - _AROUND)
    high = np.ceil(lanes.max(axis=0) + _AROUND)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _kept(file: Path, box: Box, wanted: Box | None, location: Location) -> Path:
    """Return the PNG that was made of a picture, made now if it is not there.

    Args:
        file: The picture.
        box: Of the PNG [m].
        wanted: The same where the picture says where it lies; None where the box is all of it.
        location: Of the network.
    """
    if not file.is_file():
        raise InputError("does not exist; name the picture of the land", file=file)
    state = file.stat()
    digest = hashlib.blake2b(catalog.code_digest("sumo"), digest_size=16)
    digest.update(repr((str(file.resolve()), state.st_size, state.st_mtime_ns)).encode())
    digest.update(repr((box, wanted, location)).encode())
    folder = catalog.cache_root() / "pictures" / digest.hexdigest()
    if read_folder(folder) is None:
        made = _made(file, box, location, placed=wanted is not None)
        try:
            write_folder(folder, {_NAME: made})
            make_room(folder, _MOST)
        except OSError as error:
            raise InputError(f"cannot be converted ({error})", file=file) from error
    return folder / _NAME


def _made(file: Path, box: Box, location: Location, *, placed: bool) -> bytes:
    """Return a PNG of a box."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Pillow, on damage and on large pictures
            with Image.open(file) as picture:
                tags: Any = getattr(picture, "tag_v2", {})
                picture.draft("RGB", (_SIDE, _SIDE))
                pixels = np.asarray(picture.convert("RGB"))
    except Image.DecompressionBombError:
        raise InputError("is too large; cut it to the place", file=file) from None
    except (OSError, ValueError, UnidentifiedImageError) as error:
        message = f"cannot be read ({error}); write it again as PNG, JPEG or TIFF"
        raise InputError(message, file=file) from None
    if placed:
        pixels = _laid(pixels, file, tags, box, location)
    image = Image.fromarray(pixels)
    image.thumbnail((_SIDE, _SIDE))
    out = io.BytesIO()
    image.save(out, "PNG")
    return out.getvalue()


def _laid(pixels: Any, file: Path, tags: Any, box: Box, location: Location) -> Any:
    """Return the pixels of a box, rows from the north; those beyond a picture's edge repeat it.

    Args:
        pixels: Of the picture, (rows, columns, 3).
        file: Of the picture.
        tags: Of a TIFF; empty for others.
        box: The box [m].
        location: Of the network.
    """
    if tags:
        place = placing_of(file, tags)
        x, y, dx, dy, system = place.x, place.y, place.dx, place.dy, place.system
    else:
        (x, y, dx, dy), system = world_file(file), ""
    to_picture = way_to(system, location, file)
    x0, y0, x1, y1 = box
    metres = _metres(to_picture, np.array([(x0 + x1) / 2, (y0 + y1) / 2]), dx)
    step = max(metres, (x1 - x0) / _SIDE, (y1 - y0) / _SIDE)
    columns, rows = max(int((x1 - x0) / step), 1), max(int((y1 - y0) / step), 1)
    laid = np.empty((rows, columns, 3), dtype=np.uint8)
    east = x0 + (np.arange(columns) + 0.5) * (x1 - x0) / columns
    inside = 0
    for row in range(rows):
        north = y1 - (row + 0.5) * (y1 - y0) / rows
        places = to_picture(np.column_stack([east, np.full(columns, north)]))
        column, line = (places[:, 0] - x) / dx, (y - places[:, 1]) / dy
        known = (np.abs(column - (pixels.shape[1] - 1) / 2) <= pixels.shape[1] / 2) & (
            np.abs(line - (pixels.shape[0] - 1) / 2) <= pixels.shape[0] / 2
        )
        inside += int(known.sum())
        at = np.clip(np.round(np.nan_to_num(line)), 0, pixels.shape[0] - 1).astype(np.int64)
        beside = np.clip(np.round(np.nan_to_num(column)), 0, pixels.shape[1] - 1).astype(np.int64)
        laid[row] = pixels[at, beside]
    if not inside:
        raise InputError("lies elsewhere than the roads; name a picture of this place", file=file)
    return laid


def _metres(to_picture: Any, middle: Floats, dx: float) -> float:
    """Return how large a pixel is near a place [m]."""
    moved = to_picture(middle + np.array([[0.0, 0.0], [100.0, 0.0]]))
    return 100.0 * dx / max(float(np.linalg.norm(moved[1] - moved[0])), 1e-12)
