"""How the cost of a frame grows, and what share of it Embree's raw rays would take.

Run from the repository's root, on a quiet machine:

    python tests/bench/growth.py -o docs/_bench/growth.md

CPU-seconds of all threads for a later frame, the median of those after the third, by phase. Pixels
and samples are those of the bundled motorway, rays also those of the bundled crossing by night;
road users, triangles and lamps stand on an even plane, where nothing else changes with them.
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

from bench.rays import RayRow, rays_of, table
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
from sumo3dviz_pt.model.geometry import Mesh, Transform
from sumo3dviz_pt.model.scene import FrameState, LampSet, Prototype, SceneData, Slots
from sumo3dviz_pt.pipeline.production import Production, Request, example, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset

FPS, FRAMES = 25, 6
PHASES = ("update", "render", "denoise")
TINT = {"type": "diffuse", "reflectance": {"type": "tint"}}


@dataclass(frozen=True)
class View:
    """What a camera of a scene file sees at one time.

    Attributes:
        scene: The scene file.
        camera: Its name.
        time: SUMO's [s].
        template: Instead of the scene file's; empty for its own.
    """

    scene: Path
    camera: str
    time: float
    template: str = ""

    def made(self, size: tuple[int, int], spp: int | None = None) -> Production:
        """Prepare it with `preview`, or with other samples, each pass as many as fit."""
        changes = {"template": self.template} if self.template else {}
        request = Request(camera=self.camera, quality="preview", size=size)
        times = self.time + np.arange(FRAMES) / FPS
        made = prepare(load_job(self.scene, changes), request, times)
        if spp is None:
            return made
        return replace(
            made, quality=made.quality.model_copy(update={"spp": spp, "pass_spp": min(spp, 64)})
        )


HERE = Path(__file__).parent


@dataclass(frozen=True)
class Plan:
    """What is measured.

    Attributes:
        day: Whose pixels, samples and rays are measured; its largest body is the road users'.
        night: Whose rays are measured.
        empty: That is compared with a bare scene.
        size: Of all pictures but those of the first row, width, height [px].
        sizes: Whose costs are compared.
        samples: Of a pixel.
        users: Road users.
        triangles: About how many.
        lamps: How many.
        frames: Of each, `FRAMES` at most; the first three do not count.
    """

    day: View = View(example("ronda"), "overview", 492.0)
    night: View = View(example("crossing"), "corner", 458.0, "city_night")
    empty: View = View(HERE / "scenes" / "empty_road.yaml", "overview", 492.0)
    size: tuple[int, int] = (640, 360)
    sizes: tuple[tuple[int, int], ...] = ((320, 180), (640, 360), (1280, 720), (1920, 1080))
    samples: tuple[int, ...] = (1, 4, 16, 64)
    users: tuple[int, ...] = (10, 60, 200, 600)
    triangles: tuple[int, ...] = (10_000, 100_000, 1_000_000, 3_000_000)
    lamps: tuple[int, ...] = (10, 100, 1000)
    frames: int = FRAMES


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


def timed(session: Any, frame: Callable[[int], FrameState], plan: Plan) -> dict[str, float]:
    """Return the CPU-seconds of a later frame by phase.

    Args:
        session: That renders.
        frame: The n-th frame's state; what moves must differ, or nothing is paid for it.
        plan: How many frames there are.
    """
    costs = [session.render(frame(number)).cpu for number in range(plan.frames)]
    return {
        phase: float(np.median([cost.get(phase, 0.0) for cost in costs[3:]])) for phase in PHASES
    }


def of_pictures(plan: Plan) -> list[Row]:
    """Measure growth with pixels and samples."""

    def cost(made: Production) -> dict[str, float]:
        with opened(made) as session:
            return timed(session, lambda n: made.shot.frame_at(plan.day.time + n / FPS), plan)

    rows = [Row("pixels", w * h, cost(plan.day.made((w, h)))) for w, h in plan.sizes]
    made = [(spp, plan.day.made(plan.size, spp)) for spp in plan.samples]
    return rows + [Row("samples", spp, cost(each)) for spp, each in made]


def of_plane(what: str, amount: int, scene: SceneData, state: FrameState, *, plan: Plan) -> Row:
    """Measure a frame of a small scene, whose road users drive on by a metre a frame."""
    step = Transform.from_pose((1.0, 0.0, 0.0))

    def frame(number: int) -> FrameState:
        movers = state.movers
        for _ in range(number):
            movers = tuple(replace(m, world_from_body=step @ m.world_from_body) for m in movers)
        return replace(state, movers=movers)

    with session_of(scene, size=plan.size, quality=quality_preset("preview")) as session:
        return Row(what, amount, timed(session, frame, plan))


def of_users(plan: Plan) -> list[Row]:
    """Measure growth with road users, all in full detail and in view."""
    data = plan.day.made(plan.size).shot.data
    body: Prototype = max((p for p in data.prototypes.values() if p.parts),
                          key=lambda p: p.triangles)  # fmt: skip
    rows = []
    view = view_at((-5.0, 0.0, 25.0), heading=90.0, pitch=-15.0)
    for count in plan.users:
        side = int(np.ceil(np.sqrt(count)))
        movers = [
            mover(f"v{k}", (20.0 + 6 * (k // side), 4.0 * (k % side - side / 2), 0.0),
                  (0.4, 0.1, 0.1), prototype=body.name)
            for k in range(count)
        ]  # fmt: skip
        scene = scene_of(
            [static("ground", plane(400.0), "grey")],
            {**data.materials, "grey": diffuse(0.3)},
            prototypes=[body],
            slots=Slots(near={body.name: count}),
        )
        state = FrameState(0.0, view, tuple(movers))
        rows.append(of_plane("road users", count, scene, state, plan=plan))
    return rows


def of_triangles(plan: Plan) -> list[Row]:
    """Measure growth with triangles that stand still."""
    rows = []
    view = view_at((-30.0, 0.0, 6.0), heading=90.0, pitch=-5.0)
    for wanted in plan.triangles:
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
        rows.append(of_plane("triangles", count, scene, FrameState(0.0, view, moving), plan=plan))
    return rows


def of_lamps(plan: Plan) -> list[Row]:
    """Measure growth with lamps in a dark scene."""
    rows = []
    view = view_at((-20.0, 0.0, 12.0), heading=90.0, pitch=-12.0)
    for count in plan.lamps:
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
        rows.append(of_plane("lamps", count, scene, FrameState(0.0, view, ()), plan=plan))
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


def of_nothing(plan: Plan) -> tuple[float, float]:
    """Return CPU-seconds of an empty road, and of a bare Mitsuba scene of the same meshes.

    The bare scene has one grey material, our sky as its only light, and Mitsuba's own `path`.
    """
    made = plan.empty.made(plan.size)
    state = made.shot.frame_at(plan.empty.time)
    with opened(made) as session:
        seconds = timed(session, lambda _: state, plan)
        render = bare(session.loaded.scene, made.quality)
        costs = []
        for seed in range(plan.frames):
            started = time.process_time()
            render(seed)
            costs.append(time.process_time() - started)
    return sum(seconds.values()) - seconds["denoise"], float(np.median(costs[2:]))


def bare(scene: Any, quality: Quality) -> Callable[[int], Any]:
    """Return what renders a bare scene of a scene's meshes, by its seed."""
    import mitsuba as mi

    meshes = {
        f"mesh{k}": {
            "type": "ply",
            "filename": _written(shape),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.3}},
        }
        for k, shape in enumerate(scene.shapes())
        if shape.is_mesh() and shape.id() != "sun"
    }
    path = {"type": "path", "max_depth": quality.max_depth, "rr_depth": quality.rr_depth}
    parts = {"integrator": path, "sensor": scene.sensors()[0], "sky": scene.environment()}
    made = mi.load_dict({"type": "scene", **parts, **meshes})
    return lambda seed: np.array(mi.render(made, spp=quality.spp, seed=seed))


def _written(shape: Any) -> str:
    """Write a mesh of the renderer to a file that its own loader reads."""
    target = Path(tempfile.gettempdir()) / f"bare_{shape.id()}.ply"
    shape.write_ply(str(target))
    return str(target)


def of_rays(plan: Plan) -> list[RayRow]:
    """Return the rays of a day and of a night by kind, with what Embree alone needs for them."""
    rows = []
    for name, view in (("day", plan.day), ("night", plan.night)):
        made = view.made(plan.size)
        with opened(made) as session:
            rows += rays_of(name, session, made.shot.frame_at(view.time))
    return rows


def page(rows: Sequence[Row], rays: Sequence[RayRow], nothing: tuple[float, float]) -> str:
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
    ours, bare_one = nothing
    lines += ["", *table(rays), ""]
    lines += [
        f"An empty road costs {ours:.2f} CPU-seconds, {ours / bare_one:.2f} times the"
        f" {bare_one:.2f} of a bare Mitsuba scene of the same meshes."
    ]
    return "\n".join(lines) + "\n"


def measured(plan: Plan) -> str:
    """Measure everything; return the tables."""
    rays = of_rays(plan)
    makers = (of_pictures, of_users, of_triangles, of_lamps)
    return page([row for make in makers for row in make(plan)], rays, of_nothing(plan))


def main() -> None:
    """Measure, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    options.output.write_text(measured(Plan()), encoding="utf-8")


if __name__ == "__main__":
    main()
