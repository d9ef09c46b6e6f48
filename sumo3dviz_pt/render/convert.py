"""Turns scene values and cameras into Mitsuba objects; only here both have their names.

Cameras become sensors, whose parameters are set for each view.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import Bsdf, View
from sumo3dviz_pt.render.cabins import DARK
from sumo3dviz_pt.render.coated import coated_plugin
from sumo3dviz_pt.render.draped import DRAPED, draped_texture
from sumo3dviz_pt.render.kernels import aligned, load
from sumo3dviz_pt.render.paint import paint_texture, stained_texture
from sumo3dviz_pt.render.rooms import rooms_texture
from sumo3dviz_pt.render.textures import (
    CABIN,
    PERIOD,
    ROOMS,
    UNTILED,
    WEAR_ATTRIBUTE,
    untiled_texture,
)

TINT_ATTRIBUTE = "face_tint"
RADIANCE_ATTRIBUTE = "face_radiance"
_DARK_GLASS = 0.03

# Camera frame (+x forward, +y left, +z up) from Mitsuba's (+x left, +y up, +z forward).
_CAMERA_FROM_MITSUBA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


_DEPTHS: Mapping[str, Callable[[Mapping[str, Any]], dict[str, Any]]] = {
    ROOMS: rooms_texture,
    CABIN: lambda _: constant_tint(DARK),
    "lens": lambda _: face_tint(),
}
"""What shows something behind it, by its word; cabins and lenses have depth in our kernel only."""


def plugin(value: Any, *, tint: Mapping[str, Any], worn: bool = False) -> Any:
    """Return a material dict with our own words replaced.

    Args:
        value: Of the dict, or the dict itself.
        tint: Stands for the colour.
        worn: Whether it is for a worn or painted mesh.
    """
    if not isinstance(value, Mapping):
        return value
    kind = value.get("type")
    if kind == "tint":
        return dict(tint)
    if kind == "stained":
        return stained_texture(value, tint=tint, texture=plugin(value["texture"], tint=tint))
    if kind in _DEPTHS:
        return _DEPTHS[str(kind)](tint)
    if kind in (DRAPED, UNTILED):
        laid = kind == DRAPED
        return draped_texture(value) if laid else untiled_texture(value, worn=worn)
    inner = {key: plugin(item, tint=tint, worn=worn) for key, item in value.items()}
    return coated_plugin(inner) if kind == "coated" else inner


def face_tint() -> dict[str, Any]:
    """Return what reads a face's colour from its mesh, as a plugin dict."""
    return {"type": "mesh_attribute", "name": TINT_ATTRIBUTE}


def constant_tint(colour: Colour | Floats) -> dict[str, Any]:
    """Return one colour for all faces, as a plugin dict."""
    return {"type": "rgb", "value": [float(channel) for channel in colour]}


def instance_tint() -> dict[str, Any]:
    """Return what looks up the colour of the instance that was hit, as a plugin dict."""
    return paint_texture()


def make_bsdf(bsdf: Bsdf, *, tint: Mapping[str, Any], worn: bool = False) -> Any:
    """Make a material object.

    Args:
        bsdf: A material with our own words.
        tint: Stands for the colour, as a plugin dict.
        worn: Whether it is for a worn or painted mesh.
    """
    return load(plugin(bsdf, tint=tint, worn=worn))


def make_mesh(
    name: str, mesh: Mesh, *, bsdf: Any, attributes: Mapping[str, Floats] | None = None
) -> Any:
    """Make a mesh object.

    Args:
        name: Its name in messages.
        mesh: Geometry, relative to the renderer's origin.
        bsdf: A material object.
        attributes: Values per face, or per vertex if the name says so, by attribute
            name, (m or n, channels).
    """
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    shape = mi.Mesh(
        name,
        vertex_count=len(mesh.vertices),
        face_count=len(mesh.faces),
        has_vertex_normals=mesh.normals is not None,
        has_vertex_texcoords=mesh.uvs is not None,
        props=properties,
    )
    _fill(shape, mesh)
    for attribute, values in (attributes or {}).items():
        shape.add_attribute(attribute, values.shape[1], flat(values))
    return shape


def make_lamps(
    name: str,
    mesh: Mesh,
    *,
    bsdf: Any,
    emitter: Mapping[str, Any],
    tint: Floats | None = None,
) -> Any:
    """Make a mesh that can shine; at first it is dark.

    Args:
        name: Of the shape.
        mesh: With the lamp's number in u.
        bsdf: What it is made of.
        emitter: As a plugin dict; it may read the faces' attribute `RADIANCE_ATTRIBUTE`.
        tint: Reflectance of each face for tinted materials, (m, 3); default dark glass.
    """
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    properties["mesh_emitter"] = load(emitter)
    shape = mi.Mesh(
        name,
        vertex_count=len(mesh.vertices),
        face_count=len(mesh.faces),
        has_vertex_texcoords=mesh.uvs is not None,
        props=properties,
    )
    shape.add_attribute(RADIANCE_ATTRIBUTE, 3, np.zeros(3 * len(mesh.faces), np.float32))
    glass = np.full((len(mesh.faces), 3), _DARK_GLASS) if tint is None else tint
    shape.add_attribute(TINT_ATTRIBUTE, 3, flat(glass))
    if mesh.wear is not None:
        shape.add_attribute(WEAR_ATTRIBUTE, 3, flat(mesh.wear))
    _fill(shape, mesh)
    return shape


def _fill(shape: Any, mesh: Mesh) -> None:
    """Write a mesh's arrays."""
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = flat(mesh.vertices)
    parameters["faces"] = aligned(mesh.faces, np.uint32)
    if mesh.normals is not None:
        parameters["vertex_normals"] = flat(mesh.normals)
    if mesh.uvs is not None:
        # Whole periods are dropped, so that float32 still tells texels of far places apart.
        # Meshes that show one road together drop multiples of a common period, to agree.
        period = 1.0 if mesh.wear is None else float(PERIOD)
        whole = np.floor(mesh.uvs.min(axis=0) / period) if len(mesh.uvs) else 0.0
        uvs = mesh.uvs - period * whole
        # Image rows run down and Mitsuba's v runs up.
        parameters["vertex_texcoords"] = flat(uvs * [1.0, -1.0])
    parameters.update()


def flat(values: Floats) -> NDArray[np.float32]:
    """Return any array as flat float32, as parameters of a scene take it."""
    return aligned(values, np.float32)


def overwrite(parameters: Any, key: str, values: Floats) -> None:
    """Write a parameter's values where the old ones lie.

    Frozen recordings keep the address of attributes and textures and would go on to show
    old or freed values (measured with Dr.Jit 1.5); a new array would never reach them.

    Args:
        parameters: Of Mitsuba's scene.
        key: Name of the parameter.
        values: As many as before, in any shape.
    """
    target = parameters[key]
    if "scalar" in mi.variant():
        parameters[key] = flat(values)
        return
    dr.scatter(target, mi.Float(flat(values)), dr.arange(mi.UInt32, len(target)))
    dr.eval(target)
    parameters.set_dirty(key)


_ABSENT = np.uint32(0x80000000)
"""Bit of a corner's number in faces that are hidden: no mesh has such a vertex."""


def faces_of(parameters: Any, name: str) -> NDArray[np.uint32]:
    """Return the corners of a mesh's faces, hidden or not, (m, 3).

    Args:
        parameters: Of Mitsuba's scene.
        name: Of the mesh.
    """
    return np.array(parameters[f"{name}.faces"], np.uint32).reshape(-1, 3) & ~_ABSENT


def hide(parameters: Any, name: str, hidden: Bools) -> None:
    """Leave faces of a mesh out of the trees from their next update on, and no others.

    Embree leaves out faces whose corners do not exist, and so builds its trees sooner. Other
    variants keep all faces, whose places must be out of sight anyway.

    Args:
        parameters: Of Mitsuba's scene.
        name: Of the mesh.
        hidden: Which faces, (m,).
    """
    if not mi.variant().startswith("llvm"):
        return
    target, faces = parameters[f"{name}.faces"], faces_of(parameters, name)
    faces[hidden] |= _ABSENT
    index = dr.arange(mi.UInt32, len(target))
    dr.scatter(target, mi.UInt32(aligned(faces, np.uint32)), index)
    dr.eval(target)


def shift(parameters: Any, name: str, mesh: Mesh, origin: Floats) -> None:
    """Move a mesh of a loaded scene to where it lies relative to an origin.

    Args:
        parameters: Of Mitsuba's scene.
        name: Of the mesh.
        mesh: Geometry in the network's coordinates.
        origin: The renderer's new origin, (3,) [m].
    """
    overwrite(parameters, f"{name}.vertex_positions", mesh.vertices - origin)
    if mesh.normals is not None:
        # Otherwise Mitsuba computes other normals from the moved points.
        overwrite(parameters, f"{name}.vertex_normals", mesh.normals)


def scalar_transform(matrix: Floats) -> Any:
    """Return a transform for scene dicts."""
    return mi.ScalarTransform4f(np.ascontiguousarray(matrix, np.float64))


def transform(matrix: Floats) -> Any:
    """Return a transform for parameters of a loaded scene."""
    return mi.Transform4f(np.ascontiguousarray(matrix, np.float32))


def relative(world_from_body: Transform, origin: Floats) -> Floats:
    """Return a placement's matrix relative to the renderer's origin, (4, 4)."""
    matrix = world_from_body.matrix.copy()
    matrix[:3, 3] -= origin
    return matrix


def sensor_matrix(view: View, origin: Floats) -> Floats:
    """Return Mitsuba's `to_world` of a view, (4, 4)."""
    return np.asarray(relative(view.world_from_camera, origin) @ _CAMERA_FROM_MITSUBA)


@dataclass(frozen=True, slots=True)
class PicturePart:
    """A part of a picture that is cut into as many rows as columns.

    Attributes:
        row: From the top, from 0.
        column: From the left, from 0.
        of: Rows, and columns.
    """

    row: int = 0
    column: int = 0
    of: int = 1


WHOLE = PicturePart()

_OTHERS = 1.0
"""Opening angle that Mitsuba's camera has where it is not what rays come from [rad]."""

NEAR_CLIP = 0.001
"""How far before the eye rays begin, along the axis [m]."""


def sensor_entry(size: tuple[int, int], *, pixels: str, sampler: str, spp: int) -> dict[str, Any]:
    """Return a pinhole camera; place and opening angle come with each frame.

    Args:
        size: Width, height [px].
        pixels: `rgb` or `rgba`.
        sampler: Mitsuba's name of it.
        spp: Samples per pass.
    """
    width, height = size
    return {
        "type": "perspective",
        "fov": 50.0,
        "near_clip": NEAR_CLIP,
        "far_clip": 1e7,
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "component_format": "float32",
            "pixel_format": pixels,
            # OIDN needs uncorrelated pixels; every filter but the box splats.
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": sampler, "sample_count": spp},
    }


def view_parameters(view: View, origin: Floats) -> dict[str, Any]:
    """Return a sensor's parameters for a view, by name.

    Args:
        view: What it sees.
        origin: The loaded scene's, (3,) [m].
    """
    # Rays of other lenses are our own; a sensor is only their film then.
    opening = view.lens.opening if view.lens.is_pinhole else _OTHERS
    return {
        "to_world": transform(sensor_matrix(view, origin)),
        "x_fov": float(np.degrees(opening)),
    }


def part_parameters(view: View, origin: Floats, part: PicturePart) -> dict[str, Any]:
    """Return a sensor's parameters for a part of a view's picture, by name.

    Args:
        view: Of the whole picture.
        origin: The loaded scene's, (3,) [m].
        part: What the sensor sees of it.
    """
    if not view.lens.is_pinhole:
        return view_parameters(view, origin)
    narrowed = replace(view, lens=view.lens.middle_part(part.of))
    # From the picture's middle to the part's, in widths and heights of the part.
    middle = (part.of - 1) / 2.0
    return {
        **view_parameters(narrowed, origin),
        "principal_point_offset_x": part.column - middle,
        "principal_point_offset_y": part.row - middle,
    }
