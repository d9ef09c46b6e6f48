"""What our kernel compiles only for scenes that have it, and what leaving it out saves.

The kernel asks tables and lights of a loaded scene what there is. The same is told here from the
scene's plain values, before anything is loaded, so that `check` can say it.
"""

from __future__ import annotations

from collections.abc import Mapping

from sumo3dviz_pt.model.scene import Bsdf, SceneData
from sumo3dviz_pt.render.kernel.rows import Kind, RowMaker, kinds_of, lobes_of

OPERATIONS: Mapping[str, int] = {
    "textures": 1170,
    "coats": 210,
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
        "textures": bool(kinds & (Kind.UNTILED | Kind.BITMAP | Kind.ROUGH)),
        "coats": lobes.coats,
        "leaves": lobes.leaves,
        "metal": lobes.metals,
        "foreign materials": Kind.FOREIGN in kinds,
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
