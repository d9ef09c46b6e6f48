"""Builds an exported scene in Blender and renders it with Cycles, by orders on standard input.

Runs in a Python of its own that has the package `bpy` (4.5), which our package never needs:

    python tests/bench/blender/script.py FOLDER WIDTH HEIGHT

Each line is a JSON object: `spp`, `seed`, `denoise`, `moved` (bodies move a little before) and
`out` (an EXR file). Each answer is a line with CPU-seconds of all threads and wall seconds.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

ANSWER = "ANSWER "
"""What lines begin with that are answers; Blender writes others."""


def spent() -> float:
    """Return the CPU-seconds of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


class Builder:
    """Makes Blender's objects from an exported scene."""

    def __init__(self, folder: Path) -> None:
        self.said = json.loads((folder / "scene.json").read_text(encoding="utf-8"))
        self.arrays = dict(np.load(folder / "scene.npz"))
        self.scene = bpy.context.scene
        self.movable: list[tuple[Any, Matrix]] = []
        for thing in list(bpy.data.objects):
            bpy.data.objects.remove(thing)

    def build(self) -> None:
        bodies: dict[str, list[Any]] = {}
        for number, said in enumerate(self.said["meshes"]):
            mesh = self.mesh(f"mesh{number}")
            mesh.materials.append(self.surface(number, said))
            if said["body"]:
                bodies.setdefault(said["body"], []).append(mesh)
            else:
                self.place(said["name"], mesh)
        for said in self.said["instances"]:
            matrix = Matrix(said["matrix"])
            for mesh in bodies.get(said["body"], ()):
                placed = self.place("body", mesh, matrix)
                placed.color = (*said["colour"], 1.0)
                self.movable.append((placed, matrix))
        for said in self.said["lamps"]:
            mesh = self.mesh(said["key"])
            mesh.materials.append(self.lamp(said))
            self.place(said["key"], mesh)
        self.beams()
        self.sky()
        self.camera()

    def place(self, name: str, data: Any, matrix: Matrix | None = None) -> Any:
        placed = bpy.data.objects.new(name, data)
        if matrix is not None:
            placed.matrix_world = matrix
        self.scene.collection.objects.link(placed)
        return placed

    def mesh(self, key: str) -> Any:
        vertices, faces = self.arrays[f"{key}_vertices"], self.arrays[f"{key}_faces"]
        used, faces = np.unique(faces, return_inverse=True)
        vertices, faces = vertices[used], faces.reshape(-1, 3)
        mesh = bpy.data.meshes.new(key)
        mesh.vertices.add(len(vertices))
        mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
        mesh.loops.add(faces.size)
        mesh.loops.foreach_set("vertex_index", faces.astype(np.int32).ravel())
        mesh.polygons.add(len(faces))
        mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
        normals = self.arrays.get(f"{key}_normals")
        smooth = np.full(len(faces), normals is not None)
        mesh.polygons.foreach_set("use_smooth", smooth)
        mesh.update(calc_edges=True)
        if normals is not None:
            mesh.normals_split_custom_set_from_vertices(normals[used].tolist())
        self.attributes(mesh, key)
        return mesh

    def attributes(self, mesh: Any, key: str) -> None:
        if f"{key}_colour" in self.arrays:
            colour = self.arrays[f"{key}_colour"]
            colour = np.column_stack([colour, np.ones(len(colour))]).astype(np.float32)
            made = mesh.attributes.new("colour", "FLOAT_COLOR", "FACE")
            made.data.foreach_set("color", colour.ravel())
        for name in ("roughness", "metallic"):
            if f"{key}_{name}" in self.arrays:
                values = self.arrays[f"{key}_{name}"].astype(np.float32).ravel()
                mesh.attributes.new(name, "FLOAT", "FACE").data.foreach_set("value", values)

    def surface(self, number: int, said: dict[str, Any]) -> Any:
        material, nodes, links, out = fresh(f"mesh{number}")
        if said["kind"] == "leaf":
            self.leaf(number, said, nodes, links, out)
            return material
        varied = f"mesh{number}_metallic" in self.arrays
        parts = []
        if said["kind"] == "principled":
            parts.append(self.gloss(number, said, nodes, links))
        if varied or said["metallic"][0] == 0.0:
            parts.append(self.lambert(number, said, nodes, links))
        if len(parts) == 2:
            both = nodes.new("ShaderNodeAddShader")
            for socket, part in zip(both.inputs, parts, strict=True):
                links.new(part.outputs[0], socket)
            parts = [both]
        links.new(parts[0].outputs[0], out.inputs["Surface"])
        return material

    def gloss(self, number: int, said: dict[str, Any], nodes: Any, links: Any) -> Any:
        """Principled: all of a metal, and else without diffuse light, which it would dim."""
        shader = nodes.new("ShaderNodeBsdfPrincipled")
        shader.inputs["IOR"].default_value = said["ior"]
        shader.inputs["Coat Weight"].default_value = said["coat"]
        shader.inputs["Coat Roughness"].default_value = said["coat_roughness"]
        shader.inputs["Coat IOR"].default_value = 1.5
        for name in ("roughness", "metallic"):
            socket = shader.inputs[name.capitalize()]
            socket.default_value = said[name][0]
            if f"mesh{number}_{name}" in self.arrays:
                links.new(self.attribute(nodes, name).outputs["Fac"], socket)
        shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        if f"mesh{number}_metallic" in self.arrays:
            self.where_metal(number, said, nodes, links, (shader.inputs["Base Color"], 1.0))
        elif said["metallic"][0] > 0.0:
            self.coloured(number, said, nodes, links, shader.inputs["Base Color"])
        return shader

    def lambert(self, number: int, said: dict[str, Any], nodes: Any, links: Any) -> Any:
        """Diffuse light of what is no metal."""
        shader = nodes.new("ShaderNodeBsdfDiffuse")
        if f"mesh{number}_metallic" in self.arrays:
            self.where_metal(number, said, nodes, links, (shader.inputs["Color"], 0.0))
        else:
            self.coloured(number, said, nodes, links, shader.inputs["Color"])
        return shader

    def where_metal(
        self, number: int, said: dict[str, Any], nodes: Any, links: Any, into: tuple[Any, float]
    ) -> None:
        """Give a socket the colour of faces that are metal (1), or of those that are not (0)."""
        socket, wanted = into
        tinted = nodes.new("ShaderNodeVectorMath")
        tinted.operation = "SCALE"
        links.new(tinted.outputs[0], socket)
        self.coloured(number, said, nodes, links, tinted.inputs[0])
        count = Sums(nodes, links)
        metal = count("GREATER_THAN", self.attribute(nodes, "metallic").outputs["Fac"], 0.0)
        links.new(count("COMPARE", metal, wanted, 0.5), tinted.inputs["Scale"])

    @staticmethod
    def attribute(nodes: Any, name: str) -> Any:
        read = nodes.new("ShaderNodeAttribute")
        read.attribute_name = name
        return read

    def leaf(self, number: int, said: dict[str, Any], nodes: Any, links: Any, out: Any) -> None:
        mixed = nodes.new("ShaderNodeMixShader")
        mixed.inputs[0].default_value = said["through"]
        for k, kind in enumerate(("Diffuse", "Translucent")):
            shader = nodes.new(f"ShaderNodeBsdf{kind}")
            self.coloured(number, said, nodes, links, shader.inputs["Color"])
            links.new(shader.outputs[0], mixed.inputs[1 + k])
        links.new(mixed.outputs[0], out.inputs["Surface"])

    def coloured(
        self, number: int, said: dict[str, Any], nodes: Any, links: Any, socket: Any
    ) -> None:
        plain = (*said["colour"], 1.0)
        socket.default_value = plain[: len(socket.default_value)]
        if said["painted"]:
            links.new(nodes.new("ShaderNodeObjectInfo").outputs["Color"], socket)
        elif f"mesh{number}_colour" in self.arrays:
            links.new(self.attribute(nodes, "colour").outputs["Color"], socket)

    def lamp(self, said: dict[str, Any]) -> Any:
        known = bpy.data.materials.get(said["material"])
        if known is not None:
            return known
        material, nodes, links, out = fresh(said["material"])
        # The colour stays a constant and tells all of the lamp's light, as the light tree reads
        # nothing else; how it is spread is told by the strength, which it takes for 1.
        shader = nodes.new("ShaderNodeEmission")
        whole = [channel * said["share"] for channel in said["radiance"]]
        shader.inputs["Color"].default_value = (*whole, 1.0)
        if f"{said['key']}_colour" in self.arrays:
            read = self.attribute(nodes, "colour")
            links.new(read.outputs["Color"], shader.inputs["Color"])
        geometry = nodes.new("ShaderNodeNewGeometry")
        cosine = nodes.new("ShaderNodeVectorMath")
        cosine.operation = "DOT_PRODUCT"
        links.new(geometry.outputs["Incoming"], cosine.inputs[0])
        links.new(geometry.outputs["True Normal"], cosine.inputs[1])
        count = Sums(nodes, links)
        less = count("SUBTRACT", cosine.outputs["Value"], 1.0)
        fall = count("EXPONENT", count("MULTIPLY", less, said["sharpness"]))
        spread = 1.0 if f"{said['key']}_colour" in self.arrays else said["share"]
        lobe = (1.0 - said["floor"]) / spread, said["floor"] / spread
        share = count("MULTIPLY_ADD", fall, *lobe)
        front = count("SUBTRACT", 1.0, geometry.outputs["Backfacing"])
        links.new(count("MULTIPLY", share, front), shader.inputs["Strength"])
        links.new(shader.outputs[0], out.inputs["Surface"])
        material.cycles.emission_sampling = "FRONT" if said["sampled"] else "NONE"
        return material

    def beams(self) -> None:
        if not self.said["beams"]:
            return
        pattern = self.arrays["pattern"]
        image = bpy.data.images.new(
            "pattern", pattern.shape[1], pattern.shape[0], float_buffer=True
        )
        image.colorspace_settings.name = "Non-Color"
        # Blender's rows run from below to above. The light tree knows a spot's energy
        # only, and noise is least where emitters are picked by the root of the second moment.
        usual = float(np.sqrt((pattern**2).mean()))
        grey = np.repeat(pattern[::-1, :, None] / usual, 4, axis=2)
        image.pixels.foreach_set(np.ascontiguousarray(grey, np.float32).ravel())
        for number, said in enumerate(self.said["beams"]):
            light = bpy.data.lights.new(f"beam{number}", "SPOT")
            colour = np.array(said["intensity"])
            light.energy = 4.0 * np.pi * float(colour.max()) * usual
            light.color = colour / colour.max()
            light.spot_size, light.spot_blend = 2.0 * said["half_angle"], 0.0
            light.shadow_soft_size = 0.0
            patterned(light, image, float(np.tan(said["half_angle"])))
            # Blender's spot looks along -z; ours has +z ahead, +x to its left, +y up.
            turned = Matrix(said["matrix"]) @ Matrix.Diagonal((-1.0, 1.0, -1.0, 1.0))
            self.place("beam", light, turned)

    def sky(self) -> None:
        pixels = self.arrays["sky"]
        height, width = pixels.shape[:2]
        image = bpy.data.images.new("sky", width, height, float_buffer=True)
        image.colorspace_settings.name = "Non-Color"
        whole = np.concatenate([pixels, np.ones((height, width, 1), np.float32)], axis=2)
        image.pixels.foreach_set(whole.ravel())
        world = bpy.data.worlds.new("sky")
        world.use_nodes = True
        node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = image
        shader = world.node_tree.nodes["Background"]
        world.node_tree.links.new(node.outputs["Color"], shader.inputs["Color"])
        self.scene.world = world
        said = self.said["sun"]
        if said:
            light = bpy.data.lights.new("sun", "SUN")
            colour = np.array(said["irradiance"])
            light.energy, light.color = float(colour.max()), colour / colour.max()
            light.angle = said["angle"]
            turn = Vector(said["direction"]).to_track_quat("Z", "Y").to_matrix().to_4x4()
            self.place("sun", light, turn)

    def camera(self) -> None:
        data = bpy.data.cameras.new("camera")
        data.sensor_fit = "HORIZONTAL"
        data.angle_x = self.said["opening"]
        data.clip_start, data.clip_end = 0.01, 1e6
        self.scene.camera = self.place("camera", data, Matrix(self.said["camera"]))


class Sums:
    """Makes nodes that count."""

    def __init__(self, nodes: Any, links: Any) -> None:
        self.nodes, self.links = nodes, links

    def __call__(self, operation: str, *values: Any) -> Any:
        node = self.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, values, strict=False):
            if isinstance(value, float | int):
                socket.default_value = value
            else:
                self.links.new(value, socket)
        return node.outputs[0]


def fresh(name: str) -> tuple[Any, Any, Any, Any]:
    """Return a new material, its nodes and links, and its output."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree.nodes, tree.links, tree.nodes.new("ShaderNodeOutputMaterial")


def patterned(light: Any, image: Any, slope: float) -> None:
    """Let a spot throw a picture that is even in the tangent of the angle."""
    light.use_nodes = True
    nodes, links = light.node_tree.nodes, light.node_tree.links
    count = Sums(nodes, links)
    parts = nodes.new("ShaderNodeSeparateXYZ")
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Normal"], parts.inputs[0])
    ahead = count("MULTIPLY", count("ABSOLUTE", parts.outputs[2]), 2.0 * slope)
    place = nodes.new("ShaderNodeCombineXYZ")
    for axis in range(2):
        across = count("DIVIDE", parts.outputs[axis], ahead)
        links.new(count("ADD", across, 0.5), place.inputs[axis])
    texture = nodes.new("ShaderNodeTexImage")
    texture.image, texture.extension = image, "CLIP"
    links.new(place.outputs[0], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Emission"].inputs["Strength"])


def settle(size: tuple[int, int], said: dict[str, Any]) -> None:
    """Choose Cycles' settings."""
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    render.use_persistent_data = True
    render.film_transparent = False
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.use_auto_tile = False
    for name in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{name}_bounces", said["bounces"])
    cycles.transparent_max_bounces = 8
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = said["limit"]
    cycles.blur_glossy = 0.0
    cycles.pixel_filter_type = "BOX"
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"


def rendered(builder: Builder, order: dict[str, Any]) -> dict[str, float]:
    """Render as ordered; return what it cost."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed = order["spp"], order["seed"]
    scene.cycles.use_denoising = order.get("denoise", False)
    scene.render.filepath = order["out"]
    began, wall = spent(), time.perf_counter()
    if order.get("moved"):
        for placed, matrix in builder.movable:
            placed.matrix_world = Matrix.Translation((order["moved"], 0.0, 0.0)) @ matrix
    bpy.ops.render.render(write_still=True)
    return {"cpu": spent() - began, "wall": time.perf_counter() - wall}


def main() -> None:
    """Build, then do what is ordered."""
    folder, width, height = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what Blender says goes to the errors
    began = spent()
    builder = Builder(folder)
    settle((width, height), builder.said)
    builder.build()
    about = {"cpu": spent() - began, "version": bpy.app.version_string}
    print(ANSWER + json.dumps(about), file=answers, flush=True)
    for line in sys.stdin:
        print(ANSWER + json.dumps(rendered(builder, json.loads(line))), file=answers, flush=True)


if __name__ == "__main__":
    main()
