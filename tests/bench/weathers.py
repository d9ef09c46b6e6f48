"""What weathers cost beside dry air, and shutters and apertures beside a pinhole, in one run.

Run from the repository's root, on a quiet machine, and once more with `--size 1280 720`:

    python tests/bench/weathers.py -o docs/_bench

Forecasts count nights and weathers by the frames of `fog`, `rain`, `snow` and `snowfall`: the rows
of this size in `sumo3dviz_pt/pipeline/costs.pyweathers.json` are replaced by what was measured.

Films of `crossing` are rendered and developed, camera `corner`, `preview`, by day and by night:
CPU-seconds of a frame are the median of those after the third, and developing's share of one frame.
The dry film is rendered first and last, and counts with its mean. Lenses are compared by whole
frames of as many samples, without help of other frames.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.before_after import Case, render

from sumo3dviz_pt import catalog
from sumo3dviz_pt.pipeline.production import Request, example, frame_times, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

SCENE = example("crossing")
HOURS = {"day": ("city_day", 456.0), "night": ("city_night", 458.0)}
SIZES = ((640, 360), (1280, 720))
SAMPLES, FRAMES = 16, 4

KINDS = ("dry", "fog", "rain", "snow", "snowfall")
FORECASTS = (
    Path(__file__).resolve().parents[2] / "sumo3dviz_pt" / "pipeline" / "progress" / "weathers.json"
)
"""What `check` and `--dry-run` reckon with."""

LENSES: dict[str, dict[str, Any]] = {
    "pinhole": {},
    "depth of field": {"lens.f_number": 2.8, "lens.focus": "20 m"},
    "shutter, 4 moments": {"shutter": {"angle": 180, "moments": 4}},
    "shutter, 8 moments": {"shutter": {"angle": 180, "moments": 8}},
}
"""Settings of the camera."""


@dataclass(frozen=True)
class Plan:
    """What is measured.

    Attributes:
        scene: The scene file.
        camera: A standing camera of it.
        hours: Template and time by the hour's name.
        weathers: Presets.
        size: Of weathers' films.
        preset: Their quality.
        sizes: Of lenses' frames.
    """

    scene: Path = SCENE
    camera: str = "corner"
    hours: tuple[tuple[str, tuple[str, float]], ...] = tuple(HOURS.items())
    weathers: Sequence[str] = tuple(catalog.template_names("weather"))
    size: tuple[int, int] = (640, 360)
    preset: str = "preview"
    sizes: tuple[tuple[int, int], ...] = SIZES


def of_weathers(plan: Plan) -> Iterator[str]:
    """Yield the lines of a table: each weather beside dry air."""
    yield "| hour | weather | picture | developing | frame | beside dry |"
    yield "|---|---|" + "--:|" * 4
    for hour, (template, start) in plan.hours:

        def costs(more: dict[str, Any], template: str = template, start: float = start) -> Any:
            case = Case("", str(plan.scene), plan.camera, start, template, plan.size, more)
            with tempfile.TemporaryDirectory() as folder:
                found = render(case, plan.preset, Path(folder))
            return np.array([found["later"] - found["developing"], found["developing"]])

        dry = [costs({})]
        found = {name: costs({"weather": {"preset": name}}) for name in plan.weathers}
        dry.append(costs({}))
        usual = np.mean(dry, axis=0)
        for name, (picture, developing) in {"dry": usual, **found}.items():
            frame = picture + developing
            yield (
                f"| {hour} | {name} | {picture:.2f} | {developing:.2f} | {frame:.2f}"
                f" | {frame / usual.sum():.2f} |"
            )


def of_lenses(plan: Plan) -> Iterator[str]:
    """Yield the lines of a table: lenses and shutters beside a pinhole."""
    yield "| camera | size | frame [CPU-s] | beside a pinhole |"
    yield "|---|---|--:|--:|"
    _, (template, start) = plan.hours[0]
    for size in plan.sizes:
        usual = None
        for name, settings in LENSES.items():
            changes = {f"cameras.{plan.camera}.{key}": value for key, value in settings.items()}
            seconds = _of_frames(plan, {"template": template, **changes}, start, size)
            usual = usual or seconds
            yield f"| {name} | {size[0]}x{size[1]} | {seconds:.2f} | {seconds / usual:.2f} |"


def _of_frames(plan: Plan, changes: dict[str, Any], start: float, size: tuple[int, int]) -> float:
    """Return CPU-seconds of a later frame by itself: the median of those after the first."""
    times = frame_times(start, start + FRAMES / 25, 25)
    request = Request(plan.camera, plan.preset, size, spp=SAMPLES)
    made = prepare(load_job(plan.scene, changes), request, times)
    seconds = []
    with opened(made) as session:
        for moment in times:
            began = time.process_time()
            session.render(made.frame_at(float(moment)))
            seconds.append(time.process_time() - began)
    return float(np.median(seconds[1:]))


def measured(plan: Plan) -> Iterator[str]:
    """Yield all lines of the page."""
    yield from of_weathers(plan)
    yield ""
    yield from of_lenses(plan)


def rows_of(lines: Sequence[str], size: Sequence[int]) -> list[dict[str, Any]]:
    """Return what forecasts take of a table of weathers: a row an hour, CPU-seconds by weather."""
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    rows: dict[str, dict[str, Any]] = {}
    for hour, name, *_, frame, _ in (row for row in cells if len(row) == 6 and row[0] in HOURS):
        if name in KINDS:
            rows.setdefault(hour, {"size": list(size), "hour": hour})[name] = float(frame)
    return list(rows.values())


def kept(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Replace the rows of one size in the file that forecasts read; return all of its rows."""
    known = json.loads(FORECASTS.read_text(encoding="utf-8"))
    others = [row for row in known["rows"] if row["size"] != rows[0]["size"]]
    lines = ",\n    ".join(json.dumps(row) for row in [*others, *rows])
    by = json.dumps(known["by"])
    text = f'{{\n  "by": {by},\n  "rows": [\n    {lines}\n  ]\n}}\n'
    FORECASTS.write_text(text, encoding="utf-8")
    return [*others, *rows]


def page_of(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield the manual's table of weathers: a row each size and hour, each cell beside dry air."""
    yield "| | dry | " + " | ".join(f"`{kind}`" for kind in KINDS[1:]) + " |"
    yield "|---" + "|--:" * len(KINDS) + "|"
    for row in rows:
        cells = [f"{row['dry']:.2f}"]
        cells += [f"{row[kind]:.2f} ({row[kind] / row['dry']:.2f} x)" for kind in KINDS[1:]]
        yield f"| {row['size'][0]}x{row['size'][1]}, {row['hour']} | {' | '.join(cells)} |"


def main() -> None:
    """Measure, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, help="folder of the tables")
    parser.add_argument("--size", type=int, nargs=2, default=Plan.size, help="of weathers' films")
    options = parser.parse_args()
    lines = []
    for line in measured(Plan(size=tuple(options.size))):
        print(line, flush=True)
        lines.append(line)
    if options.output:
        weathers, lenses = lines[: lines.index("")], lines[lines.index("") + 1 :]
        pages = {"weathers": page_of(kept(rows_of(weathers, options.size))), "lenses": lenses}
        for name, table in pages.items():
            (options.output / f"{name}.md").write_text("\n".join(table) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
