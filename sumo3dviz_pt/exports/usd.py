"""Writes a scene as Universal Scene Description (.usd, .usda, .usdc, .usdz), with its motion.

It needs the package usd-core, the extra `usd`. Bodies that many road users show are written once
and referred to. People keep the pose that they have first: what walks in other files glides here.

References:
    OpenUSD: UsdGeom, UsdShade and the UsdPreviewSurface specification.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.errors import InstallationError
from sumo3dviz_pt.exports.looks import Geometry, Look, Piece, picture_of
from sumo3dviz_pt.exports.scene import Exported, ExportedCamera, ExportedScene, Track

if TYPE_CHECKING:
    from sumo3dviz_pt.model.geometry import Floats

PICTURE = re.compile(r"\w+_\d+\.png")
"""Name of a picture in the folder beside a file."""

_SUNLIGHT = np.pi  # so that a sunlit white wall is white


def needed() -> Any:
    """Return the package `pxr`.

    Raises:
        InstallationError: If it is not there.
    """
    try:
        import pxr
    except ImportError as error:
        raise InstallationError(
            "USD needs usd-core, and .glb needs nothing: pip install usd-core"
        ) from error
    return pxr


def write_usd(scene: ExportedScene, path: Path) -> None:
    """Write a scene.

    Args:
        scene: What leaves.
        path: Ends in .usd, .usda, .usdc or .usdz; pictures lie in a folder beside it, or
            inside a .usdz.

    Raises:
        InstallationError: If usd-core is not installed.
        OSError: If it cannot be written.
    """
    needed()
    from pxr import UsdUtils

    if path.suffix != ".usdz":
        _Writer(scene, path).write()
        return
    import tempfile

    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.stem}-") as folder:
        inner = Path(folder) / f"{path.stem}.usdc"
        _Writer(scene, inner).write()
        if not UsdUtils.CreateNewUsdzPackage(str(inner), str(path)):
            raise OSError(f"{path} could not be packed")


@dataclass(slots=True, eq=False)
class _Writer:
    """A stage while it is filled."""

    scene: ExportedScene
    path: Path
    _stage: Any = None
    _names: dict[str, int] = field(default_factory=dict)
    _known: dict[Any, Any] = field(default_factory=dict)
    _held: list[Geometry] = field(default_factory=list)

    def write(self) -> None:
        """Fill and save it."""
        from pxr import Gf, Usd, UsdGeom

        scene = self.scene
        self._stage = stage = Usd.Stage.CreateNew(str(self.path))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        root = UsdGeom.Xform.Define(stage, "/World")
        stage.SetDefaultPrim(root.GetPrim())
        origin, time = [float(x) for x in scene.origin], float(scene.times[0])
        root.GetPrim().SetCustomDataByKey("origin", Gf.Vec3d(*origin))
        root.GetPrim().SetCustomDataByKey("sumo_time", time)
        if len(scene.times) > 1:
            step = float(scene.times[1] - scene.times[0])
            stage.SetTimeCodesPerSecond(1.0 / step)
            stage.SetFramesPerSecond(1.0 / step)
            stage.SetStartTimeCode(0.0)
            stage.SetEndTimeCode(float(len(scene.times) - 1))
        UsdGeom.Scope.Define(stage, "/World/Looks")
        stage.CreateClassPrim("/World/Bodies")
        for thing in scene.things:
            self._thing(thing, "/World")
        for camera in scene.cameras:
            self._camera(camera)
        self._sun()
        stage.GetRootLayer().Save()

    def _sun(self) -> None:
        """Add the sun, if it shines."""
        from pxr import Gf, UsdLux

        turn = self.scene.sun_turn
        if turn is None:
            return
        facing = np.eye(4)
        facing[:3, :3] = turn.as_matrix()
        light = UsdLux.DistantLight.Define(self._stage, "/World/sun")
        light.CreateIntensityAttr(_SUNLIGHT)
        light.CreateAngleAttr(0.53)
        light.CreateNormalizeAttr(True)
        light.AddTransformOp().Set(Gf.Matrix4d(*facing.T.ravel().tolist()))

    def _name(self, parent: str, name: str) -> str:
        """Return a path that no other prim has."""
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = plain if not plain[:1].isdigit() else f"_{plain}"
        path = f"{parent}/{plain or '_'}"
        count = self._names.get(path, 0)
        self._names[path] = count + 1
        return path if not count else f"{path}__{count}"

    def _thing(self, thing: Exported, parent: str) -> None:
        """Add a thing with all that is in its frame."""
        from pxr import UsdGeom

        path = self._name(parent, thing.name)
        prim = UsdGeom.Xform.Define(self._stage, path)
        prim.GetPrim().SetCustomDataByKey("family", thing.family)
        prim.GetPrim().SetCustomDataByKey("name", thing.name)
        if thing.track is not None:
            self._place(prim, thing.track)
        if thing.pieces:
            shown = UsdGeom.Xform.Define(self._stage, f"{path}/shape")
            shown.GetPrim().GetReferences().AddInternalReference(self._body(thing))
            shown.GetPrim().SetInstanceable(True)
        for child in thing.children:
            self._thing(child, path)

    def _place(self, prim: Any, track: Track) -> None:
        """Say where a prim is, how it moves, and when it is there."""
        from pxr import Gf, UsdGeom

        place = prim.AddTransformOp()
        matrices = track.matrices if track.moves else track.matrices[:1]
        for index, matrix in enumerate(matrices):
            value = Gf.Matrix4d(*matrix.T.ravel().tolist())
            if len(matrices) > 1:
                place.Set(value, float(index))
            else:
                place.Set(value)
        if track.there.all():
            return
        seen = UsdGeom.Imageable(prim).CreateVisibilityAttr()
        words = np.where(track.there, UsdGeom.Tokens.inherited, UsdGeom.Tokens.invisible)
        changes = [0, *(np.flatnonzero(track.there[1:] != track.there[:-1]) + 1).tolist()]
        for index in changes:
            seen.Set(str(words[index]), float(index))

    def _body(self, thing: Exported) -> str:
        """Return the path of what a thing shows, written once for all that show the same."""
        from pxr import UsdGeom

        looks = [thing.look(piece) for piece in thing.pieces]
        pairs = zip(thing.pieces, looks, strict=True)
        weights = None if thing.track is None else thing.track.weights
        pose = () if weights is None else tuple(weights[0].tolist())
        key = (pose, *((id(piece.geometry), look) for piece, look in pairs))
        if key not in self._known:
            path = self._name("/World/Bodies", thing.name)
            UsdGeom.Xform.Define(self._stage, path)
            for number, (piece, look) in enumerate(zip(thing.pieces, looks, strict=True)):
                self._mesh(f"{path}/part{number}", piece, look, pose)
            self._known[key] = path
        known: str = self._known[key]
        return known

    def _mesh(self, path: str, piece: Piece, look: Look, pose: Sequence[float]) -> None:
        """Add a mesh with its look, in a pose."""
        from pxr import UsdGeom, UsdShade, Vt

        geometry = piece.geometry
        self._held.append(geometry)  # no other takes its identity
        mesh = UsdGeom.Mesh.Define(self._stage, path)
        shifts = zip(pose, geometry.moved, strict=bool(geometry.moved))
        posed = geometry.points + sum(share * shift for share, shift in shifts)
        points = np.ascontiguousarray(posed, np.float32)
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
        corners = np.ascontiguousarray(geometry.faces.ravel(), np.int32)
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corners))
        three = np.full(len(geometry.faces), 3, np.int32)
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(three))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(look.open)
        bounds = np.stack([points.min(axis=0), points.max(axis=0)])
        mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(bounds))
        if geometry.normals is not None:
            normals = np.ascontiguousarray(geometry.normals, np.float32)
            mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
            mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
        _lay(mesh, geometry, look)
        coloured = geometry.colours is not None and look.picture is None
        # A picture takes one factor only: the mean of the corners' colours.
        mean = np.ones(3) if geometry.colours is None else geometry.colours.mean(axis=0)
        factor = np.round(mean * look.colour, 3)
        binding = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
        binding.Bind(self._material(look, coloured, factor))

    def _material(self, look: Look, coloured: bool, factor: Floats) -> Any:
        """Return a look's material, written once."""
        key = (look, coloured, None if coloured else tuple(factor.tolist()))
        if key not in self._known:
            self._known[key] = self._new_material(look, coloured, factor)
        return self._known[key]

    def _new_material(self, look: Look, coloured: bool, factor: Floats) -> Any:
        """Add a preview surface."""
        from pxr import Gf, Sdf, UsdShade

        path = self._name("/World/Looks", look.name or "look")
        material = UsdShade.Material.Define(self._stage, path)
        shader = UsdShade.Shader.Define(self._stage, f"{path}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        number, colour = Sdf.ValueTypeNames.Float, Sdf.ValueTypeNames.Color3f
        shader.CreateInput("roughness", number).Set(look.roughness)
        shader.CreateInput("metallic", number).Set(look.metallic)
        if look.coat is not None:
            shader.CreateInput("clearcoat", number).Set(1.0)
            shader.CreateInput("clearcoatRoughness", number).Set(look.coat)
        if max(look.glow) > 0.0:
            shader.CreateInput("emissiveColor", colour).Set(Gf.Vec3f(*look.glow))
        base = shader.CreateInput("diffuseColor", colour)
        if look.picture is not None:
            base.ConnectToSource(self._texture(path, look.picture, factor))
        elif coloured:
            reader = UsdShade.Shader.Define(self._stage, f"{path}/colours")
            reader.CreateIdAttr("UsdPrimvarReader_float3")
            reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
            base.ConnectToSource(reader.CreateOutput("result", Sdf.ValueTypeNames.Float3))
        else:
            base.Set(Gf.Vec3f(*factor.tolist()))
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        return material

    def _texture(self, path: str, picture: Path, factor: Floats) -> Any:
        """Add what reads a picture; it is copied beside the file."""
        from PIL import Image as Pictures
        from pxr import Gf, Sdf, UsdShade

        folder = self.path.with_name(f"{self.path.stem}_pictures")
        names = self._known.setdefault("pictures", {})
        plain = re.sub(r"\W", "_", picture.parent.name)
        name = names.setdefault(picture, f"{plain}_{len(names)}.png")
        if not (folder / name).exists():
            folder.mkdir(exist_ok=True)
            Pictures.fromarray(picture_of(picture).pixels).save(folder / name)
        reader = UsdShade.Shader.Define(self._stage, f"{path}/st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        laid = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        texture = UsdShade.Shader.Define(self._stage, f"{path}/picture")
        texture.CreateIdAttr("UsdUVTexture")
        place = Sdf.AssetPath(f"./{folder.name}/{name}")
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(place)
        texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
        for side in ("wrapS", "wrapT"):
            texture.CreateInput(side, Sdf.ValueTypeNames.Token).Set("repeat")
        scale = texture.CreateInput("scale", Sdf.ValueTypeNames.Float4)
        scale.Set(Gf.Vec4f(*factor.tolist(), 1.0))
        texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(laid)
        return texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)

    def _camera(self, camera: ExportedCamera) -> None:
        """Add a camera; USD's look along -z with +y up."""
        from pxr import UsdGeom

        prim = UsdGeom.Camera.Define(self._stage, self._name("/World", f"camera_{camera.name}"))
        width, height = self.scene.size
        across = 36.0  # a film's width; with its focal length it says the angle [mm]
        prim.CreateHorizontalApertureAttr(across)
        prim.CreateVerticalApertureAttr(across * height / width)
        prim.CreateFocalLengthAttr(0.5 * across / camera.slope)
        matrices = camera.placed(self.scene.origin)
        self._place(prim, Track(matrices, np.ones(1, dtype=np.bool_)))


def _lay(mesh: Any, geometry: Geometry, look: Look) -> None:
    """Give a mesh its picture's coordinates and its corners' colours."""
    from pxr import Sdf, UsdGeom, Vt

    values, names = UsdGeom.PrimvarsAPI(mesh), Sdf.ValueTypeNames
    if geometry.uvs is not None:
        uvs = geometry.uvs - np.floor(geometry.uvs.min(axis=0))
        # v runs up there.
        turned = np.ascontiguousarray(uvs * [1.0, -1.0], np.float32)
        laid = values.CreatePrimvar("st", names.TexCoord2fArray, UsdGeom.Tokens.vertex)
        laid.Set(Vt.Vec2fArray.FromNumpy(turned))
    if geometry.colours is not None:
        shown = np.ascontiguousarray(geometry.colours * look.colour, np.float32)
        kind = names.Color3fArray
        colours = values.CreatePrimvar("displayColor", kind, UsdGeom.Tokens.vertex)
        colours.Set(Vt.Vec3fArray.FromNumpy(shown))
