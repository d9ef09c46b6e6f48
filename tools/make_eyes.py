"""Draws what four eyes see from every model: python tools/make_eyes.py FOLDER PICTURE.jpg

Driver, passenger, cyclist and pedestrian look out of every vehicle and every person of the library,
at the example crossing, by day and by night; `--models` and `--times` name a few. The sheet grows
while it is drawn; the mean luminance of each picture is printed, and a dark one makes it fail.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import Model, models_for
from sumo3dviz_pt.image.tonemap import develop
from sumo3dviz_pt.job.settings import Job, LagrangianCamera
from sumo3dviz_pt.pipeline.live import Ground
from sumo3dviz_pt.pipeline.production import ready_renderer
from sumo3dviz_pt.pipeline.scene_file import load_job, quality_preset
from sumo3dviz_pt.render.session import RenderSettings, Session
from sumo3dviz_pt.shot.build import Shot
from sumo3dviz_pt.shot.picking import build_roam, camera_view
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS
from sumo3dviz_pt.world.build import World

EYES = ("driver", "passenger", "cyclist", "pedestrian")
"""Views of the sheet."""

TIMES = ("city_day", "city_night")
"""Templates of the sheet."""

CROSSING = Path(__file__).parents[1] / "examples" / "crossing"
START, ALONG, SPEED = np.array([236.0, 286.0]), np.radians(6.87), 8.0
"""Where fronts are at first, on a lane towards the crossing [m], its direction [rad], and how fast
vehicles drive [m/s]."""

EVERY = 10.0
"""From one model's turn to the next [s]."""

WALKING = 1.3  # speed of people [m/s]
SECONDS = (0.0, 1.0, 2.0)  # of each turn
MOMENT = 1.0  # of it that is shown [s]
LEAD, ONCOMING = (24.0, 0.0), (52.0, 9.8)
"""Another car ahead, and one that comes towards: along the lane and to its left [m]."""

WALK = (0.0, -4.9)  # the same of people who walk beside it [m]

DARK = 20.0
"""A view whose mean luminance is not above this shows no street, in codes of 8 bits."""

Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What an eye sees.

    Attributes:
        model: Whose body it looks out of.
        view: A name in `scene_templates/camera`.
        template: Of the scene.
        pixels: 8-bit sRGB, (h, w, 3).
    """

    model: str
    view: str
    template: str
    pixels: Pixels

    @property
    def luminance(self) -> float:
        """Mean of the picture, in codes of 8 bits."""
        return float((self.pixels @ np.array([0.2126, 0.7152, 0.0722])).mean())


def model_names() -> tuple[str, ...]:
    """Return all vehicles that somebody can get, then all people."""
    return (*(model.name for model in models_for({})), *catalog.names("people"))


def write_scene(folder: Path, names: Sequence[str]) -> Path:
    """Write a scene in which each model has a turn on one lane, and return its file."""
    folder.mkdir(parents=True, exist_ok=True)
    known = {model.name: model for model in models_for({})}
    types = "".join(_type(known[name]) for name in names if name in known)
    car = '<vType id="car" vClass="passenger"/>'
    (folder / "types.add.xml").write_text(f"<additional>{car}{types}</additional>")
    steps = [step for turn, name in enumerate(names) for step in _steps(turn, name, known)]
    (folder / "fcd.xml").write_text("<fcd-export>" + "".join(steps) + "</fcd-export>")
    looks = "\n".join(f"    {name}: {{model: {name}}}" for name in names)
    extra = [f"{CROSSING}/{kind}.add.xml" for kind in ("trees", "homes", "shops", "blocks")]
    scene = folder / "scene.yaml"
    scene.write_text(
        f"scenario:\n  network: {CROSSING}/crossing.net.xml.gz\n  trajectories: fcd.xml\n"
        f"  vehicle_types: types.add.xml\n  additional: [{', '.join(extra)}]\n"
        f"template: city_day\nseed: 3\nvehicles:\n  by_id:\n{looks}\n"
        "output: {size: [160, 90], fps: 1}\n"
    )
    return scene


def _type(model: Model) -> str:
    """A vType as large as a model."""
    length, width, height = model.size
    vclass = min(model.vclasses & set(CLASS_DEFAULTS), default="passenger")
    return (
        f'<vType id="{model.name}" vClass="{vclass}" length="{length:.3f}"'
        f' width="{width:.3f}" height="{height:.3f}"/>'
    )


def _steps(turn: int, name: str, known: dict[str, Model]) -> Iterator[str]:
    """A model's turn: it drives or walks, one car ahead of it and one towards it."""
    for second in SECONDS:
        way = SPEED * second
        rows = [_row("vehicle", f"lead_{turn}", "car", (LEAD[0] + way, LEAD[1]))]
        towards = (ONCOMING[0] - way, ONCOMING[1])
        rows.append(_row("vehicle", f"oncoming_{turn}", "car", towards, back=True))
        if name in known:
            rows.append(_row("vehicle", name, name, (way, 0.0)))
        else:
            rows.append(_row("person", name, "", (WALK[0] + WALKING * second, WALK[1])))
        yield f'<timestep time="{EVERY * turn + second:.2f}">{"".join(rows)}</timestep>'


def _row(tag: str, name: str, kind: str, at: tuple[float, float], *, back: bool = False) -> str:
    """A row of the log; its place is along the lane and to its left."""
    turn = np.array([[np.cos(ALONG), -np.sin(ALONG)], [np.sin(ALONG), np.cos(ALONG)]])
    x, y = START + turn @ np.array(at)
    angle = (90.0 - np.degrees(ALONG) + (180.0 if back else 0.0)) % 360.0
    speed = WALKING if tag == "person" else SPEED
    said = f'id="{name}" x="{x:.2f}" y="{y:.2f}" angle="{angle:.2f}" speed="{speed}"'
    return f"<{tag} {said}/>" if tag == "person" else f'<{tag} {said} type="{kind}"/>'


def look(
    scene: Path,
    names: Sequence[str],
    *,
    template: str,
    views: Sequence[str],
    size: tuple[int, int],
    quality: str = "preview",
) -> Iterator[Seen]:
    """Yield what every view shows from every model.

    Args:
        scene: From `write_scene`, of the same names.
        names: Of the models.
        template: Of the scene.
        views: Presets of cameras.
        size: Of each picture [px].
        quality: A preset's name.
    """
    job = load_job(scene, {"template": template})
    backend = ready_renderer()
    ground = Ground.of(job)
    world = World.of(ground.scenario, job)
    cameras = [LagrangianCamera(mode="lagrangian", vehicle=n, view=views[0]) for n in names]
    times = (ground.begin, ground.end)
    x, y = START
    eyes = np.array([[x, y, 1.5], [x + 40.0, y + 5.0, 1.5]])
    shot = build_roam(world, ground.trajectories, times=times, eyes=eyes, riding=cameras)
    exposure = shot.data.sky.exposure + job.output.exposure
    settings = RenderSettings(size, quality_preset(quality), job.seed, white=2.0**-exposure)
    with Session(shot.data, backend, settings) as session:
        for turn, name in enumerate(names):
            for view in views:
                pixels = _picture(session, shot, job, name, view, EVERY * turn + MOMENT)
                yield Seen(name, view, template, pixels)


def _picture(session: Session, shot: Shot, job: Job, name: str, view: str, time: float) -> Pixels:
    """One picture, developed as films are."""
    camera = LagrangianCamera(mode="lagrangian", vehicle=name, view=view)
    seen = camera_view(shot, camera, time, left_hand=False)
    radiance = session.render(shot.frame_of(time, seen)).radiance
    exposure = shot.data.sky.exposure + job.output.exposure
    return develop(radiance, exposure=exposure, tone=job.output.tone, glare=job.output.glare)


def sheet(pictures: Sequence[Seen], *, models_in_row: int) -> Image.Image:
    """Put pictures together: a row of views by day and one by night for each model."""
    high, wide = pictures[0].pixels.shape[:2]
    names = list(dict.fromkeys(seen.model for seen in pictures))
    views = list(dict.fromkeys(seen.view for seen in pictures))
    templates = list(dict.fromkeys(seen.template for seen in pictures))
    across, title = len(views) * wide, 11
    down = len(templates) * high + title
    rows = -(-len(names) // models_in_row)
    made = Image.new("RGB", (models_in_row * (across + 6), rows * down), "white")
    draw = ImageDraw.Draw(made)
    for seen in pictures:
        row, column = divmod(names.index(seen.model), models_in_row)
        x, y = column * (across + 6), row * down
        draw.text((x, y), f"{seen.model}: {', '.join(views)}", fill="black")
        x += views.index(seen.view) * wide
        y += title + templates.index(seen.template) * high
        made.paste(Image.fromarray(seen.pixels), (x, y))
    return made


def main() -> None:
    """Draw the sheet that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the scene's files go")
    parser.add_argument("picture", type=Path, help="the sheet, .jpg or .png")
    parser.add_argument("--models", nargs="*", default=model_names(), help="default all")
    parser.add_argument("--times", nargs="*", default=TIMES, help="templates; default day, night")
    parser.add_argument("--quality", default="preview", help="a preset; default preview")
    parser.add_argument("--size", type=int, default=128, help="width of each picture [px]")
    parser.add_argument("--columns", type=int, default=3, help="models in a row")
    options = parser.parse_args()
    scene = write_scene(options.folder, options.models)
    size = (options.size, options.size * 9 // 16)
    found: list[Seen] = []
    for template in options.times:
        pictures = look(
            scene,
            options.models,
            template=template,
            views=EYES,
            size=size,
            quality=options.quality,
        )
        for seen in pictures:
            found.append(seen)
            sheet(found, models_in_row=options.columns).save(options.picture, quality=80)
            print(f"{seen.model} {seen.view} {template} {seen.luminance:.0f}", flush=True)
    darkest = min(found, key=lambda seen: seen.luminance)
    print(f"darkest: {darkest.model}, {darkest.view}: {darkest.luminance:.1f} of 255")
    if darkest.luminance <= DARK:
        parser.exit(1, f"{darkest.model} sees nothing as {darkest.view}\n")


if __name__ == "__main__":
    main()
