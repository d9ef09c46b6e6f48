"""Materials as other tools know them: a colour, a picture, and how rough and metallic they are.

What no exchange format can say becomes simpler: worn and painted roads get colours at their
corners, rooms behind panes become dark glass, and pictures that we lay without repetition repeat.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, Ints, Mesh, worn_colours
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.model.scene import Bsdf, Part, is_tinted

_WHITE: Colour = (1.0, 1.0, 1.0)
_BEHIND: Mapping[str, Colour] = {"rooms": (0.03, 0.031, 0.033), "cabin": (0.02, 0.022, 0.023)}
"""Reflectance of panes, behind which other tools see nothing."""

_PAINTED = 0.5  # share of paint from which on a face of a road is paint
_PAINT_ROUGHNESS = 0.5
_STEPS = 1024.0  # colours of corners are told apart by this [1]
_LARGEST = 2048  # pictures are made smaller than this [px]
_BRIGHT = 99.9  # percentile of a picture's values that becomes white


@dataclass(frozen=True, slots=True)
class Look:
    """What a surface looks like.

    Attributes:
        colour: Linear reflectance; multiplied with the corners' colours and the picture.
        picture: A file, or None.
        roughness: [0, 1].
        metallic: [0, 1].
        specular: Strength of the reflection that has no colour, 1 that of glass (4 %).
        coat: Roughness of a varnish over all this; None without one.
        glow: Radiance, in scene units.
        open: Whether it is seen from behind.
        name: What people find it by; looks that differ in nothing else are one.
    """

    colour: Colour = _WHITE
    picture: Path | None = None
    roughness: float = 0.5
    metallic: float = 0.0
    specular: float = 1.0
    coat: float | None = None
    glow: Colour = (0.0, 0.0, 0.0)
    open: bool = False
    name: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """A mesh of one look.

    Attributes:
        points: (n, 3) [m].
        faces: Counter-clockwise, (m, 3).
        normals: Unit, (n, 3); None is flat.
        uvs: Of its picture, v runs down, (n, 2); None without a picture.
        colours: Linear, at its corners, (n, 3); None is white.
        moved: How its points move in each pose, one (n, 3) for each [m]; empty for what is rigid.
    """

    points: Floats
    faces: Ints
    normals: Floats | None = None
    uvs: Floats | None = None
    colours: Floats | None = None
    moved: tuple[Floats, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A geometry and its look.

    Attributes:
        geometry: Where it is.
        look: What it looks like, but for its mover's colour.
        role: Which of a mover's colours it takes; empty for none.
    """

    geometry: Geometry
    look: Look
    role: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture whose brightest values are white, so that factors on it need not exceed 1.

    Attributes:
        pixels: sRGB, (h, w, 3).
        white: Linear reflectance of its white.
    """

    pixels: np.ndarray[Any, np.dtype[np.uint8]] = field(repr=False)
    white: float


@lru_cache(maxsize=64)
def picture_of(path: Path) -> Picture:
    """Read a picture of reflectances, at most 2048 pixels wide and high.

    Raises:
        InputError: If an .exr or .hdr file cannot be read.
    """
    from PIL import Image as Pictures

    from sumo3dviz_pt.image.tonemap import srgb_encoded
    from sumo3dviz_pt.library.pictures import read_linear

    if path.suffix.lower() in {".exr", ".hdr"}:
        linear = np.asarray(read_linear(path), np.float64)
        step = -(-max(linear.shape[:2]) // _LARGEST)
        linear = linear[::step, ::step]
    else:
        with Pictures.open(path) as opened:
            shrunk = opened.convert("RGB")
            shrunk.thumbnail((_LARGEST, _LARGEST))
            table = np.array([linear_from_srgb(code / 255.0) for code in range(256)])
            linear = table[np.asarray(shrunk)]
    white = max(float(np.percentile(linear.max(axis=2), _BRIGHT)), 1e-3)
    values = np.clip(linear / white, 0.0, 1.0)
    return Picture(np.round(255.0 * srgb_encoded(values)).astype(np.uint8), white)


def pieces_of(part: Part, bsdf: Bsdf, poses: Sequence[Floats] = ()) -> list[Piece]:
    """Return a part as other tools show it.

    Args:
        part: Mesh, tints and role.
        bsdf: Its material.
        poses: Its mesh's points in the poses that it takes, (n, 3) each [m].
    """
    mesh, (look, kind) = part.mesh, _look_of(bsdf)
    # Some are pictures of users.
    look = replace(look, name=Path(part.material).stem.rpartition(":")[2])
    if not len(mesh.faces):
        return []
    tinted = is_tinted(bsdf)
    role = part.role or ("own" if tinted and part.tint is None else "")
    if kind.get("wear") and mesh.wear is not None:
        return _worn(mesh, look, kind)
    corners = None
    if tinted and part.tint is not None:
        stained = _stain(look, kind)
        corners = np.repeat(np.clip(part.tint * stained, 0.0, 1.0)[:, None], 3, axis=1)
        look = _recoloured(look, _WHITE)
    elif look.picture is not None:
        gain = np.array(kind.get("gain", _WHITE), float)
        look = _recoloured(look, np.minimum(gain * picture_of(look.picture).white, 1.0))
    return [Piece(_unwelded(mesh, corners, look, poses), look, role)]


def _recoloured(look: Look, colour: Any) -> Look:
    """Return a look of another colour."""
    red, green, blue = (float(channel) for channel in colour)
    return replace(look, colour=(red, green, blue))


def _stain(look: Look, kind: Mapping[str, Any]) -> Floats:
    """Return what tints are multiplied with where a picture stains them, (3,)."""
    if look.picture is None:
        return np.ones(3)
    mean = np.maximum(np.array(kind.get("mean", _WHITE), float), 0.01)
    return np.asarray(picture_of(look.picture).white / mean)


def _worn(mesh: Mesh, look: Look, kind: Mapping[str, Any]) -> list[Piece]:
    """Return a road's surface, and the paint on it, which has no picture."""
    wear = mesh.wear
    assert wear is not None
    mean = np.array(kind.get("mean", (0.2, 0.2, 0.2)), float)
    corners = worn_colours(wear, mean)[mesh.faces]
    painted = wear[:, 1][mesh.faces].mean(axis=1) > _PAINTED
    pieces = []
    if not painted.all():
        shown, own = _faces(mesh, ~painted), corners[~painted]
        if look.picture is not None:
            own = own / np.maximum(mean, 0.01) * picture_of(look.picture).white
        bare = _recoloured(look, _WHITE)
        pieces.append(Piece(_unwelded(shown, np.clip(own, 0.0, 1.0), bare), bare))
    if painted.any():
        paint = Look(roughness=_PAINT_ROUGHNESS, name="road paint")
        shown = _faces(mesh, painted)
        pieces.append(Piece(_unwelded(shown, np.clip(corners[painted], 0.0, 1.0), paint), paint))
    return pieces


def _faces(mesh: Mesh, which: Bools) -> Mesh:
    """Return a mesh with some of its faces."""
    return Mesh(mesh.vertices, mesh.faces[which], mesh.normals, mesh.uvs)


def _unwelded(
    mesh: Mesh, corners: Floats | None, look: Look, poses: Sequence[Floats] = ()
) -> Geometry:
    """Return a mesh whose points have one colour each, without points that no face has.

    Args:
        mesh: Geometry.
        corners: Colours of the faces' corners, (m, 3, 3); None is white.
        look: Whether there is a picture.
        poses: Points in the poses that it takes, (n, 3) each [m].
    """
    flat = mesh.faces.ravel()
    if corners is None:
        kept, faces = np.unique(flat, return_inverse=True)
        colours = None
    else:
        codes = np.round(corners.reshape(-1, 3) * _STEPS).astype(np.int64)
        packed = (codes[:, 0] * 4096 + codes[:, 1]) * 4096 + codes[:, 2]
        keys = np.stack([flat, packed], axis=1)
        _, first, faces = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        kept, colours = flat[first], codes[first] / _STEPS
    pictured = look.picture is not None and mesh.uvs is not None
    return Geometry(
        mesh.vertices[kept],
        faces.reshape(-1, 3),
        None if mesh.normals is None else mesh.normals[kept],
        mesh.uvs[kept] if pictured and mesh.uvs is not None else None,
        colours,
        tuple(pose[kept] - mesh.vertices[kept] for pose in poses),
    )


def _look_of(bsdf: Bsdf) -> tuple[Look, Mapping[str, Any]]:
    """Return a material's look, and the word for its colour, which says how it is worn."""
    kind, back = str(bsdf["type"]), False
    if kind == "twosided":
        bsdf, back = bsdf["bsdf"], True
        kind = str(bsdf["type"])
    word = bsdf.get("base_color", bsdf.get("reflectance", bsdf.get("specular_reflectance", {})))
    colour, picture, about = _colour_of(word)
    if kind == "conductor":
        return Look(colour, None, 0.0, 1.0, open=back), about
    if kind == "diffuse":
        return Look(colour, picture, 1.0, 0.0, 0.0, open=back), about
    if kind == "coated":
        coat = _number(bsdf.get("roughness", 0.05))
        under = _number(bsdf.get("under_roughness", 0.4))
        return Look(colour, picture, under, coat=coat, open=back), about
    look = Look(
        colour,
        picture,
        _number(bsdf.get("roughness", 0.5)),
        _number(bsdf.get("metallic", 0.0)),
        min(2.0 * _number(bsdf.get("specular", 0.5)), 1.0),
        open=back or kind == "principledthin",
    )
    return look, about


def _colour_of(word: Mapping[str, Any]) -> tuple[Colour, Path | None, Mapping[str, Any]]:
    """Return colour, picture and further words of what stands for a colour."""
    kind = word.get("type")
    if kind == "rgb":
        red, green, blue = np.broadcast_to(np.array(word["value"], float), 3).tolist()
        return (red, green, blue), None, {}
    if kind in _BEHIND:
        return _BEHIND[str(kind)], None, {}
    if kind == "stained":
        _, picture, about = _colour_of(word["texture"])
        return _WHITE, picture, {**about, "mean": word["mean"]}
    if kind in ("bitmap", "draped", "untiled"):
        return _WHITE, Path(str(word["filename"])), word
    return _WHITE, None, {}


def _number(value: Any) -> float:
    """Return a number, or the mean of what differs from place to place."""
    if isinstance(value, Mapping):
        return float(value.get("roughness", 0.5))
    return float(value)
