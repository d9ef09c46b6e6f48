"""Writes a scene as glTF 2.0 in one binary file (.glb), with its motion.

The library that we read meshes with writes no motion and no poses, so the format is written here:
a list of nodes, meshes and materials in JSON, and one block of numbers.

Things that leave and come have no size while they are away, as glTF has no other way to say so.
The file is y up; its first node turns everything.

References:
    Khronos, glTF 2.0 specification, with KHR_lights_punctual, KHR_materials_clearcoat,
    KHR_materials_emissive_strength, KHR_materials_specular and KHR_mesh_quantization.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.exports.looks import Geometry, Look, picture_of
from sumo3dviz_pt.exports.scene import Exported, ExportedCamera, ExportedScene, Track
from sumo3dviz_pt.model.geometry import Floats

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_TYPES = {np.dtype("<f4"): 5126, np.dtype("<u4"): 5125, np.dtype("<u2"): 5123, np.dtype("i1"): 5120}
_SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_VERTICES, _INDICES = 34962, 34963
_QUANTIZED = "KHR_mesh_quantization"
_JPEG = 92  # quality of pictures
_HALF = 0.5**0.5

_SUNLIGHT = 683.0 * np.pi
"""Of the sun [lux]: with it, Blender's importer shows a sunlit white wall as white."""


def quaternions(matrices: Floats) -> tuple[Floats, Floats, Floats]:
    """Split placements into places, turns and sizes.

    Args:
        matrices: (t, 4, 4), no shear.

    Returns:
        Places, (t, 3) [m], unit quaternions x, y, z, w, each near the one before, (t, 4), and
        sizes, (t, 3).
    """
    from scipy.spatial.transform import Rotation

    linear = matrices[:, :3, :3].copy()
    sizes = np.linalg.norm(linear, axis=1)
    mirrored = np.linalg.det(linear) < 0.0
    sizes[mirrored, 1] *= -1.0
    turns = Rotation.from_matrix(linear / sizes[:, None, :]).as_quat()
    # A quaternion and its opposite are one turn; between two far ones it would turn the long way.
    flips = np.cumprod(np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    turns[1:] *= flips[:, None]
    return matrices[:, :3, 3], turns, sizes


@dataclass(slots=True, eq=False)
class _Writer:
    """A file while it is filled."""

    scene: ExportedScene
    block: bytearray = field(default_factory=bytearray)
    said: dict[str, list[Any]] = field(default_factory=dict)
    channels: list[dict[str, Any]] = field(default_factory=list)
    samplers: list[dict[str, Any]] = field(default_factory=list)
    extensions: set[str] = field(default_factory=set)
    _known: dict[Any, int] = field(default_factory=dict)
    _kept: list[Any] = field(default_factory=list)

    def add(self, kind: str, value: dict[str, Any]) -> int:
        """Add to a list of the file; return its number there."""
        entries = self.said.setdefault(kind, [])
        entries.append(value)
        return len(entries) - 1

    def view(self, data: bytes, **more: int) -> int:
        """Add bytes, aligned to four; return the view's number."""
        self.block.extend(b"\0" * (-len(self.block) % 4))
        entry = {"buffer": 0, "byteOffset": len(self.block), "byteLength": len(data), **more}
        self.block.extend(data)
        return self.add("bufferViews", entry)

    def accessor(self, values: Any, dtype: str, *, bounded: bool = False, **view: int) -> int:
        """Add numbers, (n,) or (n, k), to a view; return their accessor's number."""
        array = np.ascontiguousarray(values, np.dtype(dtype))
        width = 1 if array.ndim == 1 else array.shape[1]
        entry: dict[str, Any] = {
            "bufferView": self.view(array.tobytes(), **view),
            "componentType": _TYPES[array.dtype],
            "count": len(array),
            "type": _SHAPES[width],
        }
        if bounded:
            rows = array.reshape(len(array), width)
            entry["min"], entry["max"] = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
        return self.add("accessors", entry)

    def once(self, key: Any, make: Any) -> int:
        """Return the number of what was made for a key before, or make it."""
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    # Looks --------------------------------------------------------------------------------

    def material(self, look: Look) -> int:
        """Return the number of a look's material."""
        return self.once(look, lambda: self.add("materials", self._material(look)))

    def _material(self, look: Look) -> dict[str, Any]:
        """Return a look as glTF says it."""
        rough: dict[str, Any] = {
            "baseColorFactor": [*np.clip(look.colour, 0.0, 1.0).tolist(), 1.0],
            "metallicFactor": look.metallic,
            "roughnessFactor": look.roughness,
        }
        if look.picture is not None:
            picture = look.picture
            rough["baseColorTexture"] = {
                "index": self.once(picture, lambda: self._texture(picture))
            }
        more: dict[str, Any] = {}
        if look.coat is not None:
            coat = {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": look.coat}
            more["KHR_materials_clearcoat"] = coat
        if look.specular < 1.0 and not look.metallic:
            more["KHR_materials_specular"] = {"specularFactor": look.specular}
        entry: dict[str, Any] = {
            "name": look.name,
            "pbrMetallicRoughness": rough,
            "doubleSided": look.open,
        }
        strength = max(look.glow)
        if strength > 0.0:
            entry["emissiveFactor"] = [channel / strength for channel in look.glow]
            more["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        self.extensions |= set(more)
        return {**entry, "extensions": more} if more else entry

    def _texture(self, path: Path) -> int:
        """Add a picture as a texture that repeats."""
        from io import BytesIO

        from PIL import Image as Pictures

        packed = BytesIO()
        Pictures.fromarray(picture_of(path).pixels).save(packed, "jpeg", quality=_JPEG)
        image = {"bufferView": self.view(packed.getvalue()), "mimeType": "image/jpeg"}
        self.once("sampler", lambda: self.add("samplers", {"magFilter": 9729, "minFilter": 9987}))
        return self.add("textures", {"source": self.add("images", image), "sampler": 0})

    # Shapes -------------------------------------------------------------------------------

    def mesh(self, thing: Exported) -> int:
        """Return the number of a thing's mesh; equal things share one."""
        pairs = [(piece.geometry, thing.look(piece)) for piece in thing.pieces]
        key = tuple((id(geometry), look) for geometry, look in pairs)
        # A body may be many road users'.
        name = thing.name if thing.track is None else thing.family
        return self.once(key, lambda: self._mesh(name, pairs))

    def _mesh(self, name: str, pairs: list[tuple[Geometry, Look]]) -> int:
        """Add a mesh of some geometries and looks."""
        primitives = []
        for geometry, look in pairs:
            shape = self._shapes(geometry)
            primitives.append({**shape, "material": self.material(look)})
        return self.add("meshes", {"name": name, "primitives": primitives})

    def _shapes(self, geometry: Geometry) -> dict[str, Any]:
        """Return a geometry's accessors, written once."""
        number = self.once(id(geometry), lambda: self._add_shape(geometry))
        shape: dict[str, Any] = self._kept[number][1]
        return shape

    def _add_shape(self, geometry: Geometry) -> int:
        """Write a geometry; it is kept, so that no other takes its identity."""
        points = self.accessor(geometry.points, "<f4", bounded=True, target=_VERTICES)
        attributes = {"POSITION": points}
        if geometry.normals is not None:
            attributes["NORMAL"] = self._normals(geometry.normals)
        if geometry.uvs is not None:
            # Whole tiles are dropped, so that single precision still tells texels apart.
            uvs = geometry.uvs - np.floor(geometry.uvs.min(axis=0))
            attributes["TEXCOORD_0"] = self.accessor(uvs, "<f4", target=_VERTICES)
        if geometry.colours is not None:
            opaque = np.column_stack([geometry.colours, np.ones(len(geometry.colours))])
            codes = np.round(65535.0 * np.clip(opaque, 0.0, 1.0))
            attributes["COLOR_0"] = self.accessor(codes, "<u2", target=_VERTICES)
            self.said["accessors"][-1]["normalized"] = True
        small = "<u2" if len(geometry.points) < 65535 else "<u4"
        shape: dict[str, Any] = {
            "attributes": attributes,
            "indices": self.accessor(geometry.faces.ravel(), small, target=_INDICES),
        }
        if geometry.moved:
            shape["targets"] = [
                {"POSITION": self.accessor(moved, "<f4", bounded=True, target=_VERTICES)}
                for moved in geometry.moved
            ]
        self._kept.append((geometry, shape))
        return len(self._kept) - 1

    def _normals(self, normals: Floats) -> int:
        """Write unit normals in three bytes each."""
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        known = lengths > 0.0
        unit = np.where(known, normals, [0.0, 0.0, 1.0]) / np.where(known, lengths, 1.0)
        padded = np.zeros((len(unit), 4))
        padded[:, :3] = np.round(127.0 * unit)
        number = self.accessor(padded, "i1", byteStride=4, target=_VERTICES)
        self.said["accessors"][number] |= {"normalized": True, "type": "VEC3"}
        self.extensions.add(_QUANTIZED)
        return number

    # Nodes --------------------------------------------------------------------------------

    def node(self, thing: Exported) -> int:
        """Add a thing with all that is in its frame."""
        extras = {"family": thing.family} | ({"thing": thing.owner} if thing.owner else {})
        entry: dict[str, Any] = {"name": thing.name, "extras": extras}
        if thing.pieces:
            entry["mesh"] = self.mesh(thing)
        children = [self.node(child) for child in thing.children]
        if children:
            entry["children"] = children
        number = self.add("nodes", entry)
        if thing.track is not None:
            self._place(number, entry, thing.track)
        return number

    def _place(self, number: int, entry: dict[str, Any], track: Track) -> None:
        """Say where a node is, and how it moves."""
        places, turns, sizes = quaternions(track.matrices)
        entry |= {
            "translation": places[0].tolist(),
            "rotation": turns[0].tolist(),
            "scale": (sizes[0] * float(track.there[0])).tolist(),
        }
        if track.moves:
            self._animate(number, "translation", places)
            self._animate(number, "rotation", turns)
        if track.there.any() and not track.there.all():
            shown = np.broadcast_to(sizes, (len(track.there), 3)) * track.there[:, None]
            self._animate(number, "scale", shown, steps=True)
        if track.weights is not None:
            entry["weights"] = track.weights[0].tolist()
            if np.ptp(track.weights, axis=0).any():
                self._animate(number, "weights", track.weights.ravel())

    def _animate(self, node: int, path: str, values: Floats, *, steps: bool = False) -> None:
        """Let a node's value follow the scene's times."""
        times = self.scene.times - self.scene.times[0]
        clock = self.once("times", lambda: self.accessor(times, "<f4", bounded=True))
        self.samplers.append(
            {
                "input": clock,
                "output": self.accessor(values, "<f4"),
                "interpolation": "STEP" if steps else "LINEAR",
            }
        )
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})

    def camera(self, camera: ExportedCamera) -> int:
        """Add a camera; glTF's look along -z with +y up."""
        width, height = self.scene.size
        upright = 2.0 * np.arctan(camera.slope * height / width)
        lens = {"yfov": float(upright), "aspectRatio": width / height, "znear": 0.1}
        seen = self.add(
            "cameras", {"type": "perspective", "name": camera.name, "perspective": lens}
        )
        matrices = camera.placed(self.scene.origin)
        extras = {"camera": camera.name, "rides": camera.rides}
        entry: dict[str, Any] = {"name": f"camera {camera.name}", "camera": seen, "extras": extras}
        number = self.add("nodes", entry)
        self._place(number, entry, Track(matrices, np.ones(1, dtype=np.bool_)))
        return number

    def sun(self, turn: Rotation) -> int:
        """Add the sun; lights shine along -z."""
        self.extensions.add("KHR_lights_punctual")
        entry = {
            "name": "sun",
            "rotation": turn.as_quat().tolist(),
            "extensions": {"KHR_lights_punctual": {"light": 0}},
        }
        return self.add("nodes", entry)

    def finished(self) -> bytes:
        """Return the whole file."""
        scene = self.scene
        inner = [self.node(thing) for thing in scene.things]
        inner += [self.camera(camera) for camera in scene.cameras]
        turn = scene.sun_turn
        if turn is not None:
            inner.append(self.sun(turn))
        root = self.add(
            "nodes",
            {
                "name": "world",
                "rotation": [-_HALF, 0.0, 0.0, _HALF],
                "children": inner,
                "extras": {"origin": scene.origin.tolist(), "sumo_time": float(scene.times[0])},
            },
        )
        said: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "sumo3dviz_pt"},
            "scene": 0,
            "scenes": [{"nodes": [root]}],
            **self.said,
            "buffers": [{"byteLength": len(self.block)}],
        }
        if self.channels:
            traffic = {"name": "traffic", "channels": self.channels, "samplers": self.samplers}
            said["animations"] = [traffic]
        if scene.sun is not None:
            light = {"type": "directional", "intensity": _SUNLIGHT, "name": "sun"}
            said["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        if self.extensions:
            said["extensionsUsed"] = sorted(self.extensions)
        if _QUANTIZED in self.extensions:
            said["extensionsRequired"] = [_QUANTIZED]
        return _packed(json.dumps(said, separators=(",", ":")).encode(), bytes(self.block))


def _packed(text: bytes, block: bytes) -> bytes:
    """Return the two chunks of a binary file behind its head."""
    text += b" " * (-len(text) % 4)
    block += b"\0" * (-len(block) % 4)
    length = 12 + 8 + len(text) + 8 + len(block)
    head = struct.pack("<4sII", b"glTF", 2, length)
    return b"".join(
        [
            head,
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(block), b"BIN\0"),
            block,
        ]
    )


def gltf(scene: ExportedScene) -> bytes:
    """Return a scene as the content of a .glb file."""
    return _Writer(scene).finished()
