"""Surfaces by key: an asset's name, an image file, or `#rrggbb`."""

from __future__ import annotations

from pathlib import Path

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials.named import matt, surface_bsdf, surface_scale
from sumo3dviz_pt.library.materials.picture_files import check_picture
from sumo3dviz_pt.library.skies.radiance_maps import read_linear
from sumo3dviz_pt.model.colour import linear_from_srgb
from sumo3dviz_pt.model.geometry import Colour, Floats
from sumo3dviz_pt.model.scene import Bsdf

KERB = "kerb"
"""The material of kerbs, walls and verges; not a surface asset."""

_FILE_SCALE = 10.0
"""Metres per tile of a user's image."""


def material_name(key: str) -> str:
    """Name the material that shows a surface."""
    return f"surface:{key}"


def colour_of(text: str) -> Colour:
    """Read `#rrggbb` as linear reflectance, at most 0.85.

    References:
        IEC 61966-2-1 (sRGB), inverse of the transfer function.

    Raises:
        ConfigError: If it is not six hexadecimal digits after `#`.
    """
    try:
        if len(text) != 7:
            raise ValueError
        red, green, blue = (int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    except ValueError:
        raise ConfigError(f"a colour is written #rrggbb, not {text!r}") from None
    return _linear(red), _linear(green), _linear(blue)


def surface_material(key: str, *, textured: bool) -> Bsdf:
    """Describe the material of a surface.

    Args:
        key: An asset's name, an image file, or `#rrggbb`.
        textured: False gives a matt constant colour.

    Raises:
        ConfigError: If there is no such surface or file, or an image reflects more than all.
        InputError: If an .exr or .hdr file cannot be read.
    """
    if key.startswith("#"):
        return matt(colour_of(key))
    if _is_file(key):
        path = Path(key).resolve()
        _check_reflectance(path)
        return matt({"type": "bitmap", "filename": str(path)} if textured else (0.2, 0.2, 0.2))
    entry = catalog.find("surfaces", key)
    if textured:
        return surface_bsdf(entry)
    red, green, blue = entry.meta["albedo"]
    return matt((float(red), float(green), float(blue)))


def check_surface(key: str) -> None:
    """Refuse a surface that is not there.

    Raises:
        ConfigError: If there is no such asset or file, or it is no colour.
    """
    if key.startswith("#"):
        colour_of(key)
    elif _is_file(key):
        check_picture(Path(key))
    else:
        catalog.find("surfaces", key)


def shows_wear(key: str) -> bool:
    """Tell whether a surface's material needs meshes that say how worn and painted they are."""
    if key == KERB or key.startswith("#") or _is_file(key):
        return False
    colour = catalog.find("surfaces", key).meta["bsdf"].get("base_color", {})
    return isinstance(colour, dict) and bool(colour.get("wear"))


def metres_per_tile(key: str) -> float:
    """Return how large a surface's texture is in the world [m]."""
    if key == KERB or key.startswith("#") or _is_file(key):
        return _FILE_SCALE
    return surface_scale(key)


def planar_uvs(points: Floats, *, tile: float, near: tuple[float, float]) -> Floats:
    """Lay texture coordinates on the world's plane, shifted by whole tiles so that they stay small.

    Args:
        points: (n, 2) or (n, 3) [m].
        tile: Metres per tile, > 0.
        near: A point of the network [m]; it gets coordinates in [0, 1).

    Returns:
        (n, 2).
    """
    shift = [float(value // tile) for value in near]
    # (x / tile) - shift and not (x - x0) / tile: the shift is then an exact integer.
    return points[:, :2] / tile - shift


def _is_file(key: str) -> bool:
    """Tell whether a key means an image file.

    Raises:
        ConfigError: If it looks like one that does not exist.
    """
    path = Path(key)
    if path.suffix.lower() in {".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tga", ".bmp"}:
        if not path.is_file():
            raise ConfigError(f"there is no image file {key!r}")
        return True
    return False


def _check_reflectance(path: Path) -> None:
    """Refuse images that reflect more light than falls on them.

    Images of 8 bits end at 1, which a matt material stands; those of linear floats do not.

    Raises:
        ConfigError: If a texel is brighter than 1.
    """
    if path.suffix.lower() not in {".exr", ".hdr"}:
        return
    brightest = float(read_linear(path).max(initial=0.0))
    if brightest > 1.0:
        raise ConfigError(
            f"{path.name} holds reflectances up to {brightest:.3g}; a surface has at most 1"
        )


def _linear(value: float) -> float:
    """Inverse sRGB transfer function, capped where materials conserve energy."""
    return min(linear_from_srgb(value), 0.85)
