"""Materials as rows of numbers, and what our kernel compiles only for scenes that have it.

A row is what the kernel knows of the dict that describes a material. A material that is not
understood here, such as a user's glass, is *foreign*: Mitsuba's own object answers for it, by a
call that only scenes with such a material pay for.

The kernel asks tables and lights of a loaded scene what there is. `features_of` tells the same from
the scene's plain values, before anything is loaded, so that `check` can say it, and what leaving it
out saves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Bsdf, SceneData
from sumo3dviz_pt.render.cabins import DARK
from sumo3dviz_pt.render.draped import DRAPED
from sumo3dviz_pt.render.kernel.lobes import VARNISH, Lobes

_PRINCIPLED = {
    "type",
    "base_color",
    "roughness",
    "metallic",
    "specular",
    "spec_tint",
}
_THIN = {"type", "base_color", "roughness", "diff_trans", "spec_trans", "eta"}
_COATED = {"type", "base_color", "roughness", "under_roughness", "flop"}
_MIDDLE = 0.5  # a colour or roughness that a dict leaves out


class MaterialKind(IntFlag):
    """What is special about a material."""

    OPEN = 1
    MATT = 2
    LEAF = 4
    PAINTED = 8
    FOREIGN = 16
    STAINED = 32
    UNTILED = 64
    ROUGH = 128
    BITMAP = 256
    TINTED = 512
    ROAD = 1024
    SLABS = 2048
    PAVED = ROAD | SLABS
    SEASONED = 4096
    MIRROR = 8192
    ROOMS = 16384
    WEATHERED = 32768
    CABIN = 65536
    LENS = 131072


PLAIN = MaterialKind(0)
"""Nothing is special."""

_DEPTHS = {
    "rooms": MaterialKind.TINTED | MaterialKind.ROOMS,
    "lens": MaterialKind.TINTED | MaterialKind.LENS,
    "cabin": MaterialKind.CABIN,
}
"""Words for what shows something behind it, as a function of the ray."""


@dataclass(frozen=True, slots=True)
class Row:
    """A material as numbers.

    Attributes:
        kind: What is special about it.
        colour: Of all faces that bring none of their own, linear reflectance.
        roughness: Of all faces that bring none of their own, [0, 1].
        metallic: Of all faces that bring none of their own, [0, 1].
        eta: Relative index of refraction of the reflection without colour.
        coat: Whether it has a clear coat: 0 or 1.
        coat_roughness: Of that coat.
        flop: Of its effect paint, if no instance says it, [0, 1].
        through: Share of the light that goes through a leaf, [0, 1].
        texture: Number of the texture of its colour.
        rough_texture: Number of the texture of its roughness.
        gain: What a stained colour is multiplied with, by channel.
    """

    kind: MaterialKind = PLAIN
    colour: tuple[float, float, float] = (_MIDDLE, _MIDDLE, _MIDDLE)
    roughness: float = _MIDDLE
    metallic: float = 0.0
    eta: float = 1.5
    coat: float = 0.0
    coat_roughness: float = 0.0
    flop: float = 0.0
    through: float = 0.0
    texture: int = 0
    rough_texture: int = 0
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def numbers(self) -> Floats:
        """The row as the kernel reads it, (12,)."""
        gloss = [float(self.kind), self.eta, self.coat, self.coat_roughness]
        looks = [self.through, float(self.texture), float(self.rough_texture), self.flop]
        return np.array([*gloss, *looks, *self.gain, 0.0])


class _ForeignError(Exception):
    """A dict says something that this module does not know."""


@dataclass(slots=True)
class RowMaker:
    """Makes rows, and collects the textures that they refer to.

    Attributes:
        untiled: Dicts of bitmaps without repetition, in the order of their numbers.
        bitmaps: Dicts of plain bitmaps, in the order of their numbers.
    """

    untiled: list[Bsdf] = field(default_factory=list)
    bitmaps: list[Bsdf] = field(default_factory=list)

    def row(self, bsdf: Bsdf, *, painted: bool = False) -> Row:
        """Return a material's row.

        Args:
            bsdf: The material, with our own words.
            painted: Whether its tint is the colour of the instance that was hit.
        """
        try:
            return Row(**self._fields(bsdf, painted=painted))
        except _ForeignError:
            return Row(MaterialKind.FOREIGN)

    def _fields(self, bsdf: Bsdf, *, painted: bool) -> dict[str, Any]:
        """Return the fields of a row."""
        if bsdf.get("type") == "twosided" and set(bsdf) == {"type", "bsdf"}:
            inner = self._fields(bsdf["bsdf"], painted=painted)
            return inner | {"kind": inner["kind"] | MaterialKind.OPEN}
        makers = {
            "principled": self._principled,
            "coated": _coated,
            "principledthin": self._thin,
            "diffuse": _matt,
            "conductor": _mirror,
        }
        maker = makers.get(str(bsdf.get("type")))
        if maker is None:
            raise _ForeignError
        row = maker(bsdf)
        return row | self._coloured(row.pop("base"), row["kind"], painted=painted)

    def _principled(self, bsdf: Bsdf) -> dict[str, Any]:
        """Return the fields of a material of Disney's kind, with its colour as `base`."""
        if not set(bsdf) <= _PRINCIPLED or bsdf.get("spec_tint", 0.0) != 0.0:
            raise _ForeignError
        specular = _number(bsdf.get("specular", _MIDDLE))
        row = {
            "kind": PLAIN,
            "base": bsdf["base_color"],
            "metallic": _of_faces(bsdf.get("metallic", 0.0), 0.0),
            "eta": 2.0 / (1.0 - np.sqrt(0.08 * specular)) - 1.0 if specular > 0 else 1.001,
        }
        return row | self._roughened(bsdf.get("roughness", _MIDDLE), row)

    def _roughened(self, value: Any, row: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of a roughness: a number, one by face, or a texture."""
        if isinstance(value, Mapping) and value.get("type") == "untiled" and "roughness" in value:
            number = _numbered(self.untiled, value)
            return {"kind": row["kind"] | MaterialKind.ROUGH, "rough_texture": number}
        return {"roughness": _of_faces(value, _MIDDLE)}

    def _thin(self, bsdf: Bsdf) -> dict[str, Any]:
        """Return the fields of leaves, with their colour as `base`."""
        if not set(bsdf) <= _THIN or bsdf.get("spec_trans", 0.0) != 0.0:
            raise _ForeignError
        return {
            "kind": MaterialKind.LEAF | MaterialKind.OPEN,
            "base": bsdf["base_color"],
            "roughness": _number(bsdf.get("roughness", _MIDDLE)),
            "through": _number(bsdf.get("diff_trans", 0.0)) / 2.0,
        }

    def _coloured(self, base: Any, kind: MaterialKind, *, painted: bool) -> dict[str, Any]:
        """Return the fields of a colour: one for all, one by face or mover, or a texture."""
        word = base.get("type")
        if word == "rgb":
            value = np.broadcast_to(np.asarray(base["value"], dtype=np.float64), 3)
            return {"colour": tuple(map(float, value))}
        if word in ("tint", "mesh_attribute"):
            return {
                "kind": kind
                | (MaterialKind.PAINTED if painted and word == "tint" else MaterialKind.TINTED)
            }
        if word in _DEPTHS:
            return {"kind": kind | _DEPTHS[word], "colour": DARK}
        if word == "untiled" and "roughness" not in base:
            return self._laid(base, kind | MaterialKind.UNTILED | _paving(base))
        if word in ("bitmap", DRAPED):
            return {"kind": kind | MaterialKind.BITMAP, "texture": _numbered(self.bitmaps, base)}
        if word == "stained":
            tinted = MaterialKind.STAINED | (
                MaterialKind.PAINTED if painted else MaterialKind.TINTED
            )
            tinted |= MaterialKind.WEATHERED if base.get("weathered") else PLAIN
            inner = self._coloured(base["texture"], kind | tinted, painted=painted)
            return inner | {"gain": tuple(1.0 / max(float(mean), 0.01) for mean in base["mean"])}
        raise _ForeignError

    def _laid(self, base: Mapping[str, Any], kind: MaterialKind) -> dict[str, Any]:
        """Return the fields of a colour that is a bitmap without repetition."""
        plain = {key: value for key, value in base.items() if key != "gain"}
        row = {"kind": kind, "texture": _numbered(self.untiled, plain)}
        if "gain" not in base:
            return row
        gain = tuple(float(channel) for channel in base["gain"])
        return row | {"kind": kind | MaterialKind.SEASONED, "gain": gain}


def _coated(bsdf: Bsdf) -> dict[str, Any]:
    """Return the fields of a varnished paint, with its colour as `base`."""
    if not set(bsdf) <= _COATED:
        raise _ForeignError
    return {
        "kind": PLAIN,
        "base": bsdf["base_color"],
        "roughness": _number(bsdf["under_roughness"]),
        "eta": VARNISH,
        "coat": 1.0,
        "coat_roughness": _number(bsdf["roughness"]),
        "flop": _number(bsdf["flop"]),
    }


def _matt(bsdf: Bsdf) -> dict[str, Any]:
    """Return the fields of a perfectly diffuse material, with its colour as `base`."""
    if not set(bsdf) <= {"type", "reflectance"}:
        raise _ForeignError
    grey = {"type": "rgb", "value": _MIDDLE}
    return {"kind": MaterialKind.MATT, "base": bsdf.get("reflectance", grey)}


def _mirror(bsdf: Bsdf) -> dict[str, Any]:
    """Return the fields of a perfect mirror, with its colour as `base`."""
    known = {"type", "material", "specular_reflectance"}
    if not set(bsdf) <= known or bsdf.get("material") != "none":
        raise _ForeignError
    white = {"type": "rgb", "value": 1.0}
    return {"kind": MaterialKind.MIRROR, "base": bsdf.get("specular_reflectance", white)}


def _paving(base: Mapping[str, Any]) -> MaterialKind:
    """Return what is paved with a texture: what can be worn is, and slabs lie in rows."""
    if not base.get("wear"):
        return PLAIN
    return MaterialKind.SLABS if base.get("regular") else MaterialKind.ROAD


def _number(value: Any) -> float:
    """Return a number that must not be a texture."""
    if not isinstance(value, int | float):
        raise _ForeignError
    return float(value)


def _of_faces(value: Any, plain: float) -> float:
    """Return a number, or a plain one where faces bring their own."""
    by_face = isinstance(value, Mapping) and value.get("type") == "mesh_attribute"
    return plain if by_face else _number(value)


def _numbered(known: list[Bsdf], value: Bsdf) -> int:
    """Return the number of a texture among those that are known; a new one joins them."""
    plain = dict(value)
    if plain not in known:
        known.append(plain)
    return known.index(plain)


def kinds_of(rows: Iterable[Row]) -> MaterialKind:
    """Return everything that is special about any of some materials."""
    kinds = PLAIN
    for row in rows:
        kinds |= row.kind
    return kinds


def lobes_of(rows: Iterable[Row], *, metals: bool) -> Lobes:
    """Return what some materials have.

    Args:
        rows: The materials.
        metals: Whether any face is metallic.
    """
    rows = list(rows)
    kinds = kinds_of(rows)
    coats = any(row.coat > 0.0 for row in rows)
    return Lobes(
        coats=coats,
        leaves=MaterialKind.LEAF in kinds,
        matts=MaterialKind.MATT in kinds,
        two_sided=MaterialKind.OPEN in kinds,
        metals=metals or coats,
        mirrors=MaterialKind.MIRROR in kinds,
    )


OPERATIONS: Mapping[str, int] = {
    "textures": 1170,
    "coats": 180,
    "leaves": 58,
    "metal": 54,
    "foreign materials": 1570,
    "instances": 155,
    "lamps": 895,
    "beams": 250,
    "fog": 180,
    "wetness": 350,
    "snow": 1100,
}
"""About how many operations the kernel grows by where only this is added to an empty road under
an even sky, which has 2,290; `tests/unit/render/kernel/test_left_out.py` counts them again."""


def features_of(data: SceneData) -> frozenset[str]:
    """Return what a scene's kernel has, names of `OPERATIONS`."""
    course, lamps = data.weather, bool(data.lamps) or _carried(data)
    there = _of_materials(data, lamps=lamps) | {
        "instances": any(data.slots.near.values()),
        "lamps": lamps,
        "beams": _carried(data, "head"),
        "fog": course is not None and course.is_foggy,
        "wetness": course is not None and course.is_wet,
        "snow": course is not None and course.is_snowy,
    }
    return frozenset(name for name, has in there.items() if has)


def _of_materials(data: SceneData, *, lamps: bool) -> dict[str, bool]:
    """Return what the materials of a shot have, by name."""
    slots, bodies, maker = data.slots, data.prototypes, RowMaker()
    own = {part.part.material for part in data.static}
    own |= {part.material for name in slots.near for part in bodies[name].parts}
    own |= {"signal_lens"} if lamps else set()
    # Merged bodies are of one material, whose faces say how metallic they are.
    merged = {part.material for name in slots.far for part in bodies[name].far}
    merged |= {part.material for name in slots.deforming for part in bodies[name].parts}
    rows = [maker.row(data.materials[name]) for name in own]
    metals = any(_is_metal(data.materials[name]) for name in own | merged)
    kinds, lobes = kinds_of(rows), lobes_of(rows, metals=metals)
    return {
        "textures": bool(kinds & (MaterialKind.UNTILED | MaterialKind.BITMAP | MaterialKind.ROUGH)),
        "coats": lobes.coats,
        "leaves": lobes.leaves,
        "metal": metals,
        "foreign materials": MaterialKind.FOREIGN in kinds,
    }


def _is_metal(bsdf: Bsdf) -> bool:
    """Return whether a material of our own is metallic."""
    inner = bsdf["bsdf"] if bsdf.get("type") == "twosided" and "bsdf" in bsdf else bsdf
    value = inner.get("metallic", 0.0)
    return inner.get("type") == "principled" and isinstance(value, int | float) and value > 0.0


def _carried(data: SceneData, role: str | None = None) -> bool:
    """Return whether any road user of a shot can shine, or light the road by lamps of a role."""
    lights = data.running
    if lights is None or (role is not None and lights.beam is None):
        return False
    roles = lights.intensity if role is None else {role}
    slots = data.slots
    shown = {name for some in (slots.detailed, slots.far) for name, count in some.items() if count}
    return any(lamp.role in roles for name in shown for lamp in data.prototypes[name].lamps)
