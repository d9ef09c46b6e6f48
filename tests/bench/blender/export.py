"""A frame that the renderer shows, as plain arrays from which Blender builds the same scene.

What does not map to Cycles is made simpler on both sides before anything is rendered: textures
become their mean colours, and worn and painted surfaces the colours of their faces.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image, Ints, Mesh, worn_colours
from sumo3dviz_pt.model.scene import Bsdf, Lobe, Part, SceneData, StaticPart, View
from sumo3dviz_pt.render.compound import METALLIC_ATTRIBUTE, ROUGHNESS_ATTRIBUTE
from sumo3dviz_pt.render.convert import TINT_ATTRIBUTE
from sumo3dviz_pt.render.kernel.rows import MaterialKind, Row, RowMaker
from sumo3dviz_pt.render.loaded import HeldMesh
from sumo3dviz_pt.render.session import Session
from sumo3dviz_pt.render.sky.daylight import SUN_RADIUS

TINT = {"type": "tint"}
LEAVES = "principledthin"

DIFFERENT = (
    "textures are their mean colours, and wear and paint the colours of faces, on both sides",
    "haze is off on both sides",
    "leaves are flat on both sides: where shading and true normals disagree, Cycles loses light",
    "Disney's diffuse light (ours) is Lambert's there, added to what Principled reflects",
    "single-sided surfaces are black from behind here, and two-sided there",
    "the glass before a lamp that shines reflects here, and is black there",
    "our cap takes whole samples, Cycles' clamp the light of each bounce",
    "the moon's dark plains are an even disc there",
)
"""What is not the same on both sides, or only because both were made simpler."""

_NONE = np.zeros(0)


@dataclass(slots=True)
class Export:
    """What goes to Blender.

    Attributes:
        arrays: By name.
        said: All else, as JSON has it.
        different: Materials that could not be told.
    """

    arrays: dict[str, Any] = field(default_factory=dict)
    said: dict[str, Any] = field(default_factory=dict)
    different: list[str] = field(default_factory=list)

    def write(self, folder: Path) -> None:
        """Write everything into a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        np.savez(folder / "scene.npz", **self.arrays)
        (folder / "scene.json").write_text(json.dumps(self.said), encoding="utf-8")


def without_textures(data: SceneData) -> SceneData:
    """Return a scene whose textures are their mean colours, and worn faces have their own."""
    materials = {name: plain_material(bsdf) for name, bsdf in data.materials.items()}
    static = tuple(_plain_static(part, data.materials) for part in data.static)
    return replace(data, materials=materials, static=static, haze=None)


def plain_material(value: Any) -> Any:
    """Return a material, or a value of one, without textures."""
    if not isinstance(value, Mapping):
        return value
    word = value.get("type")
    if word == "stained":
        return dict(value.get("tint", TINT))
    if word == "untiled" and "roughness" in value:
        return float(value["roughness"])
    if word == "untiled":
        return dict(TINT) if value.get("wear") else {"type": "rgb", "value": list(mean_of(value))}
    if word == "bitmap":
        return {"type": "rgb", "value": picture_mean(Path(str(value["filename"])))}
    return {key: plain_material(item) for key, item in value.items()}


def mean_of(texture: Mapping[str, Any]) -> Floats:
    """Return the mean reflectance of a texture without repetition, (3,)."""
    return np.array(texture["mean"], float) * np.array(texture.get("gain", (1.0, 1.0, 1.0)), float)


def picture_mean(path: Path) -> list[float]:
    """Return the mean linear reflectance of a picture."""
    from PIL import Image as Pictures

    with Pictures.open(path) as picture:
        codes = np.asarray(picture.convert("RGB"), float) / 255
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return [float(channel) for channel in linear.mean(axis=(0, 1))]


def face_colours(mesh: Mesh, mean: Floats) -> Floats:
    """Return the reflectance of a surface's faces, worn and painted as they are, (m, 3)."""
    if mesh.wear is None:
        return np.tile(mean, (len(mesh.faces), 1))
    return np.asarray(worn_colours(np.asarray(mesh.wear, float), mean)[mesh.faces].mean(axis=1))


def _worn_texture(bsdf: Bsdf) -> Mapping[str, Any] | None:
    """Return the texture of a material's colour if it can be worn, else None."""
    base = bsdf.get("base_color")
    worn = isinstance(base, Mapping) and base.get("type") == "untiled" and base.get("wear")
    return base if worn else None


def _plain_static(part: StaticPart, materials: Mapping[str, Bsdf]) -> StaticPart:
    """Give the faces of a worn part their colours, and flat leaves to trees."""
    mesh, material = part.part.mesh, part.part.material
    if materials[material].get("type") == LEAVES:
        return replace(part, part=Part(replace(mesh, normals=None), material, part.part.tint))
    texture = _worn_texture(materials[material])
    if texture is None:
        return part
    return replace(part, part=Part(mesh, material, face_colours(mesh, mean_of(texture))))


def blender_camera(view: View, origin: Floats) -> Floats:
    """Return the placement of Blender's camera, which looks along -z with +y up, (4, 4)."""
    matrix = np.array(view.world_from_camera.matrix, float)
    matrix[:3, 3] -= origin
    turned = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    matrix[:3, :3] = matrix[:3, :3] @ turned
    return matrix


def blender_panorama(sky: Image) -> Image:
    """Return a sky as Blender maps it: from below to above, its middle column in the east."""
    return np.ascontiguousarray(np.roll(sky, sky.shape[1] // 4, axis=1)[::-1], np.float32)


def material_of(row: Row) -> dict[str, Any]:
    """Return what a row says of all faces, in the words of Blender's Principled."""
    leaf, matt = MaterialKind.LEAF in row.kind, MaterialKind.MATT in row.kind
    return {
        "kind": "leaf" if leaf else "matt" if matt else "principled",
        "through": row.through,
        # Only the coat reflects without colour where there is one.
        "ior": 1.0 if row.coat else float(row.eta),
        "coat": row.coat,
        "coat_roughness": row.coat_roughness,
        "painted": MaterialKind.PAINTED in row.kind,
    }


def rounded(values: Floats, digits: int = 3) -> Floats:
    """Return numbers with so many digits that count, so that few different ones are left."""
    values = np.asarray(values, float)
    size = np.where(values == 0.0, 1.0, np.abs(values))
    scale = 10.0 ** (digits - 1 - np.floor(np.log10(size)))
    return np.asarray(np.round(values * scale) / scale)


def exported(session: Session) -> Export:
    """Return the frame that a session shows, its light in whites.

    Cycles ends samples by chance that bring less than 0.01, so white must be about 1.
    """
    loaded, export = session.loaded, Export()
    assert loaded.frame is not None and loaded.origin is not None, "show a frame first"
    lamps, glows = [], loaded.glows()
    maker = RowMaker()
    export.said["meshes"] = []
    for mesh in loaded.meshes():
        if not len(loaded.parameters[f"{mesh.name}.faces"]):
            continue
        if mesh.name in glows:
            lamps.append(mesh.name)
            continue
        row = maker.row(mesh.bsdf, painted=bool(mesh.body))
        if MaterialKind.FOREIGN in row.kind:
            export.different.append(f"{mesh.name}: {dict(mesh.bsdf)}")
        _add_mesh(export, loaded.parameters, mesh, row)
    export.said["lamps"] = [said for name in lamps for said in _lamp(export, session, name)]
    export.said["instances"] = _instances(session)
    export.said["beams"] = _beams(export, session)
    _add_sky(export, session)
    view = loaded.frame.view
    export.said["camera"] = blender_camera(view, loaded.origin).tolist()
    export.said["opening"] = float(view.lens.opening)
    return export


def _numbers(parameters: Any, key: str, width: int) -> Floats:
    """Return a parameter's values, (n, width); (0, width) where there is none."""
    values = np.asarray(parameters[key]) if key in parameters else _NONE
    return np.asarray(values, np.float32).reshape(-1, width)


def _geometry(parameters: Any, name: str) -> tuple[Floats, Ints, Floats]:
    """Return a mesh's vertices, faces and normals."""
    faces = np.asarray(parameters[f"{name}.faces"]).reshape(-1, 3).astype(np.int32)
    vertices = _numbers(parameters, f"{name}.vertex_positions", 3)
    return vertices, faces, _numbers(parameters, f"{name}.vertex_normals", 3)


def solid(vertices: Floats, faces: Ints) -> Any:
    """Return which faces have an area, (m,)."""
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12


def _add_mesh(export: Export, parameters: Any, mesh: HeldMesh, row: Row) -> None:
    """Add a mesh that does not shine."""
    vertices, faces, normals = _geometry(parameters, mesh.name)
    kept = solid(vertices, faces)
    number = len(export.said["meshes"])
    said = {"name": mesh.name, "body": mesh.body, **material_of(row)}
    looks = {
        "colour": (_numbers(parameters, f"{mesh.name}.{TINT_ATTRIBUTE}", 3), row.colour),
        "roughness": (_numbers(parameters, f"{mesh.name}.{ROUGHNESS_ATTRIBUTE}", 1), row.roughness),
        "metallic": (_numbers(parameters, f"{mesh.name}.{METALLIC_ATTRIBUTE}", 1), row.metallic),
    }
    for name, (values, plain) in looks.items():
        own = len(values) == len(faces) and (name != "colour" or MaterialKind.TINTED in row.kind)
        values = values[kept] if own else values
        same = not own or bool((values == values[:1]).all())
        if not same:
            export.arrays[f"mesh{number}_{name}"] = values
        constant = np.asarray(values[0] if own and len(values) else plain, float)
        said[name] = constant.ravel().tolist()
    faces = faces[kept]
    if len(normals) == len(vertices):
        export.arrays[f"mesh{number}_normals"] = normals
    export.arrays |= {f"mesh{number}_vertices": vertices, f"mesh{number}_faces": faces}
    export.said["meshes"].append(said)


def _lamp(export: Export, session: Session, name: str) -> Iterator[dict[str, Any]]:
    """Add the lamps of a mesh that shine, in groups that shine alike; the rest is a dark mesh."""
    parameters = session.loaded.parameters
    vertices, faces, _ = _geometry(parameters, name)
    kept = solid(vertices, faces)
    glow = session.loaded.glows()[name]
    radiance = rounded(glow.radiance / session.settings.white)
    lobes = rounded(glow.lobes[:, :2])
    # Mitsuba's v runs up, ours down.
    v = -_numbers(parameters, f"{name}.vertex_texcoords", 2)[faces[:, 0], 1]
    lamp = np.minimum((v * len(radiance)).astype(int), len(radiance) - 1)
    rows = np.column_stack([radiance, lobes])[lamp]
    weight = float(np.asarray(parameters[f"{name}.emitter.sampling_weight"]).item())
    sampled = session.loaded.aimed and weight > 0.0
    glass = _numbers(parameters, f"{name}.{TINT_ATTRIBUTE}", 3)
    dark = kept & ~(radiance[lamp] > 0.0).any(axis=1)
    if dark.any():
        _add_glass(export, name, vertices, faces[dark], glass[dark])
    lit = np.flatnonzero(kept & ~dark)
    # Cycles' light tree knows where objects are, and how bright materials are whose colour is a
    # constant: lamps that paths aim at are objects of their own, with a material for each kind.
    told = rows[lit] if sampled else rows[lit] * [0.0, 0.0, 0.0, 1.0, 1.0]
    kinds, which = np.unique(told, axis=0, return_inverse=True)
    objects = lamp[lit] if sampled else which.ravel()
    for number in np.unique(objects):
        key, own = f"lamp_{name}_{number}", lit[objects == number]
        kind = int(which.ravel()[objects == number][0])
        export.arrays |= {f"{key}_vertices": vertices[faces[own]].reshape(-1, 3)}
        export.arrays |= {f"{key}_faces": np.arange(3 * len(own), dtype=np.int32).reshape(-1, 3)}
        if not sampled:
            export.arrays[f"{key}_colour"] = rows[own, :3]
        radiance_of, (floor, sharpness) = kinds[kind][:3].tolist(), kinds[kind][3:].tolist()
        yield {
            "key": key,
            "material": f"lamp_{name}_{kind}",
            "radiance": radiance_of,
            "floor": floor,
            "sharpness": sharpness,
            # Of all its light, against a lamp that shines alike everywhere.
            "share": Lobe(floor, sharpness).flux / np.pi,
            "sampled": sampled,
        }


def _add_glass(export: Export, name: str, vertices: Floats, faces: Ints, tint: Floats) -> None:
    """Add lamps that are off."""
    number = len(export.said["meshes"])
    plain = {"roughness": [0.12], "metallic": [0.0], "colour": [0.03, 0.03, 0.03]}
    export.said["meshes"].append({"name": f"{name}_off", "body": "", **material_of(Row()), **plain})
    export.arrays |= {f"mesh{number}_vertices": vertices, f"mesh{number}_faces": faces}
    export.arrays[f"mesh{number}_colour"] = tint


def _instances(session: Session) -> list[dict[str, Any]]:
    """Return where bodies are, and their colours."""
    pool = session.loaded.pool
    if pool is None:
        return []
    return [
        {
            "body": pool.body_of_slot[slot],
            "matrix": np.asarray(matrix, float).tolist(),
            "colour": np.asarray(paint[:3], float).tolist(),
        }
        for slot, (matrix, paint) in sorted(pool.placed.items())
        if slot in pool.shown
    ]


def _beams(export: Export, session: Session) -> list[dict[str, Any]]:
    """Return the beams of head lamps; they look along +z with +x to their left."""
    beams = session.loaded.running.beams
    if beams is None:
        return []
    # As Mitsuba's texture has it: rows from above to below, columns from its left.
    export.arrays["pattern"] = np.asarray(beams.beam.pattern, np.float32)
    return [
        {
            "matrix": np.asarray(matrix, float).tolist(),
            "intensity": (np.asarray(intensity, float) / session.settings.white).tolist(),
            "half_angle": float(beams.beam.half_angle),
        }
        for matrix, intensity in beams.placed.values()
        if np.any(intensity > 0.0)
    ]


def _add_sky(export: Export, session: Session) -> None:
    """Add the sky's map, and the sun or moon."""
    white = session.settings.white
    export.arrays["sky"] = blender_panorama(session.sky.radiance / white)
    sun = session.sky.sun
    export.said["sun"] = sun and {
        "direction": np.asarray(sun.direction, float).tolist(),
        "irradiance": (np.asarray(sun.irradiance, float) / white).tolist(),
        "angle": 2.0 * float(SUN_RADIUS),
    }
