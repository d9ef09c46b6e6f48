"""How the cost of a frame grows, and what share of it Embree's raw rays would take.

Run from the repository's root, on a quiet machine:

    python tests/bench/growth.py -o docs/_bench/growth.md

CPU-seconds of all threads for a later frame, the median of those after the third, by phase. Pixels,
samples and rays are those of the bundled motorway; road users, triangles and lamps stand on an
even plane, where nothing else changes with them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from builders import (
    ball,
    constant_sky,
    cube,
    diffuse,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scene import FrameState, Prototype, SceneData, Slots
from sumo3dviz_pt.pipeline.production import Production, Request, example, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset

SIZE = (640, 360)
FRAMES = 6
PHASES = ("update", "render", "denoise")
AT = 492.0


TINT = {"type": "diffuse", "reflectance": {"type": "tint"}}


@dataclass(frozen=True)
class Row:
    """One measured frame."""

    what: str
    amount: int
    seconds: dict[str, float]

    @property
    def total(self) -> float:
        """All phases."""
        return sum(self.seconds.values())


def timed(session: Any, state: FrameState, frames: int = FRAMES) -> dict[str, float]:
    """Return the CPU-seconds of a later frame by phase."""
    costs = [session.render(state).cpu for _ in range(frames)]
    return {
        phase: float(np.median([cost.get(phase, 0.0) for cost in costs[3:]])) for phase in PHASES
    }


def motorway(size: tuple[int, int], quality: Quality) -> Production:
    """The bundled motorway from above."""
    request = Request(camera="overview", quality="preview", size=size)
    made = prepare(load_job(example("ronda")), request, np.array([AT]))
    return replace(made, quality=quality)


def of_pictures() -> list[Row]:
    """Measure growth with pixels and samples."""
    rows, preview = [], quality_preset("preview")
    for size in ((320, 180), (640, 360), (1280, 720), (1920, 1080)):
        made = motorway(size, preview)
        with opened(made) as session:
            seconds = timed(session, made.shot.frame_at(AT))
        rows.append(Row("pixels", size[0] * size[1], seconds))
    for spp in (1, 4, 16, 64):
        made = motorway(SIZE, preview.model_copy(update={"spp": spp, "pass_spp": spp}))
        with opened(made) as session:
            rows.append(Row("samples", spp, timed(session, made.shot.frame_at(AT))))
    return rows


def of_plane(what: str, amount: int, scene: SceneData, state: FrameState) -> Row:
    """Measure a frame of a small scene."""
    with session_of(scene, size=SIZE, quality=quality_preset("preview")) as session:
        return Row(what, amount, timed(session, state))


def of_users() -> list[Row]:
    """Measure growth with road users, all in full detail and in view."""
    made = motorway(SIZE, quality_preset("preview"))
    body: Prototype = max(
        (p for p in made.shot.data.prototypes.values() if p.parts), key=lambda p: p.triangles
    )
    rows = []
    view = view_at((-5.0, 0.0, 25.0), heading=90.0, pitch=-15.0)
    for count in (10, 60, 200, 600):
        side = int(np.ceil(np.sqrt(count)))
        movers = [
            mover(f"v{k}", (20.0 + 6 * (k // side), 4.0 * (k % side - side / 2), 0.0),
                  (0.4, 0.1, 0.1), prototype=body.name)
            for k in range(count)
        ]  # fmt: skip
        scene = scene_of(
            [static("ground", plane(400.0), "grey")],
            {**made.shot.data.materials, "grey": diffuse(0.3)},
            prototypes=[body],
            slots=Slots(near={body.name: count}),
        )
        rows.append(of_plane("road users", count, scene, FrameState(0.0, view, tuple(movers))))
    return rows


def of_triangles() -> list[Row]:
    """Measure growth with triangles that stand still."""
    rows = []
    view = view_at((-30.0, 0.0, 6.0), heading=90.0, pitch=-5.0)
    for wanted in (10_000, 100_000, 1_000_000, 3_000_000):
        columns = round(np.sqrt(wanted / 9))
        balls = [
            static(f"ball{k}", ball((5.0 * k, 6.0 * (k % 3 - 1), 2.0), 2.0,
                   rows=columns // 2, columns=columns), "grey")
            for k in range(9)
        ]  # fmt: skip
        parts = [static("ground", plane(400.0), "grey"), *balls]
        count = sum(len(part.part.mesh.faces) for part in parts)
        materials = {"grey": diffuse(0.3), "matt_tint": TINT}
        one = Slots(near={"cube": 1})
        scene = scene_of(parts, materials, prototypes=[cube()], slots=one)
        # Something moves, so that whatever follows movements is paid for.
        moving = (mover("car", (0.0, 3.0, 0.0), (0.4, 0.1, 0.1)),)
        rows.append(of_plane("triangles", count, scene, FrameState(0.0, view, moving)))
    return rows


def of_lamps() -> list[Row]:
    """Measure growth with lamps in a dark scene."""
    rows = []
    view = view_at((-20.0, 0.0, 12.0), heading=90.0, pitch=-12.0)
    for count in (10, 100, 1000):
        side = int(np.ceil(np.sqrt(count)))
        places = [(8.0 * (k // side), 8.0 * (k % side - side / 2), 5.0) for k in range(count)]
        lamps = LampSet(
            "row",
            "street lamps",
            _looking_down(places),
            np.repeat(np.arange(count), 2),
            tuple(f"lamp{k}" for k in range(count)),
            sampled=True,
            radiance=np.full((count, 3), 200.0),
        )
        scene = scene_of([static("ground", plane(400.0), "grey")],
                         {"grey": diffuse(0.3), "signal_lens": diffuse(0.03)},
                         lamps=[lamps], sky=constant_sky(0.001))  # fmt: skip
        rows.append(of_plane("lamps", count, scene, FrameState(0.0, view, ())))
    return rows


def _looking_down(places: Sequence[tuple[float, float, float]], half: float = 0.15) -> Mesh:
    """Return squares that shine downward."""
    corners = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)])
    vertices = np.concatenate([corners + place for place in places])
    faces = [
        [4 * k + a, 4 * k + b, 4 * k + c]
        for k in range(len(places))
        for a, b, c in ((0, 2, 1), (0, 3, 2))
    ]
    return Mesh(vertices, np.array(faces), None, np.zeros((len(vertices), 2)))


def of_nothing() -> tuple[float, float]:
    """Return CPU-seconds of an empty road, and of a bare Mitsuba scene of the same meshes.

    The bare scene has one grey material, our sky as its only light, and Mitsuba's own `path`.
    """
    import mitsuba as mi

    scene = Path(__file__).parent / "scenes" / "empty_road.yaml"
    request = Request(camera="overview", quality="preview", size=SIZE)
    made = prepare(load_job(scene), request, np.array([AT]))
    state = made.shot.frame_at(AT)
    with opened(made) as session:
        seconds = timed(session, state)
        ours = sum(seconds.values()) - seconds["denoise"]
        meshes = {
            f"mesh{k}": {
                "type": "ply",
                "filename": _written(shape),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.3}},
            }
            for k, shape in enumerate(session.loaded.scene.shapes())
            if shape.id() != "sun"
        }
        sky = session.loaded.scene.environment()
        sensor = session.loaded.scene.sensors()[0]
        path = {"type": "path", "max_depth": made.quality.max_depth, "rr_depth": 2}
        bare = mi.load_dict(
            {"type": "scene", "integrator": path, "sensor": sensor, "sky": sky, **meshes}
        )
        costs = []
        for seed in range(FRAMES):
            started = time.process_time()
            np.array(mi.render(bare, spp=made.quality.spp, seed=seed))
            costs.append(time.process_time() - started)
    return ours, float(np.median(costs[2:]))


def _written(shape: Any) -> str:
    """Write a mesh of the renderer to a file that its own loader reads."""
    target = Path(tempfile.gettempdir()) / f"bare_{shape.id()}.ply"
    shape.write_ply(str(target))
    return str(target)


def of_rays() -> list[tuple[str, float]]:
    """Return how many million rays a CPU-second Embree traces on the motorway, by kind."""
    made = motorway(SIZE, quality_preset("preview"))
    state = made.shot.frame_at(AT)
    with opened(made) as session:
        session.show(state)
        return list(_raw(session))


def _raw(session: Any) -> list[tuple[str, float]]:
    """Trace rays of each kind by themselves."""
    import drjit as dr
    import mitsuba as mi

    scene = session.loaded.scene
    width, height = SIZE
    index = dr.arange(mi.UInt32, 4 * width * height)
    chance = mi.PCG32(len(index), 7)
    pixel = index // 4
    place = mi.Point2f(
        (mi.Float(pixel % width) + chance.next_float32()) / width,
        (mi.Float(pixel // width) + chance.next_float32()) / height,
    )
    ray = scene.sensors()[0].sample_ray(0.0, 0.5, place, mi.Point2f(0.5))[0]
    dr.eval(ray)
    first = scene.ray_intersect(ray)
    dr.eval(first)
    lanes = dr.compress(first.is_valid())
    normal, point = dr.gather(mi.Normal3f, first.n, lanes), dr.gather(mi.Point3f, first.p, lanes)
    start = point + 1e-2 * normal
    sun = session.sky.sun
    towards = mi.Vector3f(*(float(v) for v in (sun.direction if sun is not None else (0, 0, 1))))
    lots = mi.PCG32(len(lanes), 11)
    pair = mi.Point2f(lots.next_float32(), lots.next_float32())
    up = mi.warp.square_to_cosine_hemisphere(pair)
    shadow = mi.Ray3f(start, towards)
    bounce = mi.Ray3f(start, mi.Frame3f(mi.Vector3f(normal)).to_world(up))
    dr.eval(shadow, bounce)
    nearest, any_hit = scene.ray_intersect_preliminary, scene.ray_test
    return [
        ("primary", _pace(lambda: nearest(ray, True).t, len(index))),
        ("shadow, to the sun", _pace(lambda: any_hit(shadow), len(lanes))),
        ("bounce, nearest hit", _pace(lambda: nearest(bounce).t, len(lanes))),
        ("bounce, any hit", _pace(lambda: any_hit(bounce), len(lanes))),
    ]


def _pace(trace: Callable[[], Any], rays: int) -> float:
    """Return million rays a CPU-second, the median of five."""
    import drjit as dr

    seconds = []
    for _ in range(6):
        started = time.process_time()
        dr.eval(trace())
        dr.sync_thread()
        seconds.append(time.process_time() - started)
    return rays / float(np.median(seconds[1:])) / 1e6


def page(
    rows: Sequence[Row], rays: Sequence[tuple[str, float]], nothing: tuple[float, float]
) -> str:
    """Return the tables as Markdown."""
    lines = ["| grows | amount | a frame | " + " | ".join(PHASES) + " | growth |",
             "|---|--:|--:|" + "--:|" * len(PHASES) + "--:|"]  # fmt: skip
    before: Row | None = None
    for row in rows:
        rise = ""
        if before is not None and before.what == row.what:
            rise = f"{np.log(row.total / before.total) / np.log(row.amount / before.amount):.2f}"
        phases = " | ".join(f"{row.seconds[phase]:.2f}" for phase in PHASES)
        lines.append(f"| {row.what} | {row.amount:,} | {row.total:.2f} | {phases} | {rise} |")
        before = row
    lines += ["", "| rays | million a CPU-second |", "|---|--:|"]
    lines += [f"| {name} | {pace:.1f} |" for name, pace in rays]
    ours, bare = nothing
    lines += [
        "",
        f"An empty road: {ours:.2f} CPU-seconds, {ours / bare:.2f} x a bare scene's {bare:.2f}.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    rays = of_rays()
    rows = [row for make in (of_pictures, of_users, of_triangles, of_lamps) for row in make()]
    options.output.write_text(page(rows, rays, of_nothing()), encoding="utf-8")


if __name__ == "__main__":
    main()
