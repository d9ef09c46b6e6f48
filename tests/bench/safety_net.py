"""Stores pictures and plans of many scenes, and compares them bit by bit.

    python tests/bench/safety_net.py store FOLDER [--only WORD ...]
    python tests/bench/safety_net.py compare FOLDER OTHER [--only WORD ...]

Store before a change that must not change pictures, store again after it, compare. Only
pictures of one machine can be compared: processors round differently. Each case runs in a
process of its own, small and without denoiser, which would hide what differs. `compare`
names the parts, bodies and poses that differ, counts pixels, and writes old, new and
difference side by side into OTHER; its exit code is 1 if anything differs, or if one folder
lacks a case or a picture that the other has (`--only` compares some cases). Costs are printed
beside each other. Cases of the shared networks are left out where those are missing.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

REPOSITORY = Path(__file__).resolve().parents[2]
SHARED = REPOSITORY.parent / "shared" / "data"
SIZE = (320, 180)
SAMPLES = 4
FRAMES = 4
RATE = 25.0


@dataclass(frozen=True)
class Case:
    """A picture, or the first frames of a film.

    Attributes:
        scene: An example's name, or that of a shared network.
        camera: By name.
        time: Of the picture, or of the film's first frame [s].
        film: Whether it is a film.
        changes: Overrides of the scene file.
    """

    scene: str
    camera: str
    time: float
    film: bool = False
    changes: Mapping[str, Any] = field(default_factory=dict)


_DUSK: Mapping[str, Any] = {"template": "city_dusk"}
_NIGHT: Mapping[str, Any] = {"template": "city_night"}

CASES: Mapping[str, Case] = {
    "crossing_corner": Case("crossing", "corner", 456.0),
    "crossing_driver": Case("crossing", "driver", 490.0),
    "crossing_flight": Case("crossing", "flight", 452.0),
    "crossing_dusk": Case("crossing", "corner", 440.0, changes=_DUSK),
    "crossing_night": Case("crossing", "driver", 500.0, changes=_NIGHT),
    "crossing_abstract": Case("crossing", "corner", 456.0, changes={"template": "abstract"}),
    "ronda_overview": Case("ronda", "overview", 490.0),
    "ronda_driver": Case("ronda", "driver", 465.0),
    "ronda_night": Case("ronda", "flight", 450.0, changes=_NIGHT),
    "bologna_overview": Case("bologna_acosta", "overview", 1529.0),
    "barcelona_driver": Case("barcelona", "driver", 1259.0),
    "monaco_overview": Case("monaco_west_hills", "overview", 529.0),
    "film_crossing_driver": Case("crossing", "driver", 492.0, film=True),
    "film_crossing_flight_night": Case("crossing", "flight", 446.0, film=True, changes=_NIGHT),
    "film_ronda_overview": Case("ronda", "overview", 482.0, film=True),
    "film_bologna_driver_dusk": Case("bologna_acosta", "driver", 1526.0, film=True, changes=_DUSK),
}
"""Twelve stills and four films: day, dusk, night and plain, three modes, five networks."""

_RIDES = {
    "bologna_acosta": "Togliatti_9_481",
    "barcelona": "back_directionc4.78",
    "monaco_west_hills": "car309",
}
_OVERVIEWS = {
    "bologna_acosta": ([1503.21, 856.31, 11.0], [1503.14, 817.26, 1.0]),
    "barcelona": ([19381.94, 17875.75, 11.0], [19413.31, 17899.0, 1.0]),
    "monaco_west_hills": ([2523.04, 2801.63, 474.0], [2546.92, 2832.53, 464.0]),
}


def job_of(case: Case) -> Any:
    """The scene file of a case."""
    from sumo3dviz_pt.pipeline.production import example
    from sumo3dviz_pt.pipeline.scene_file import load_job, make_job

    if case.scene not in _RIDES:
        return load_job(example(case.scene), {**case.changes, "output.half": False})
    position, look_at = _OVERVIEWS[case.scene]
    eulerian = {"mode": "eulerian", "position": position, "look_at": look_at, "lens": {"fov": 60}}
    driver = {"mode": "lagrangian", "vehicle": _RIDES[case.scene], "view": "driver"}
    settings = {
        "scenario": {"folder": str(SHARED / case.scene)},
        "template": "city_day",
        "seed": 1,
        "cameras": {"overview": eulerian, "driver": driver},
        "output": {"half": False},
    }
    return make_job({**settings, **case.changes})


def take(name: str, folder: Path) -> None:
    """Render a case into a folder, with an account of what was built and what it cost."""
    from sumo3dviz_pt.pipeline.live import OpenShot, plan_times
    from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
    from sumo3dviz_pt.report.machine import peak_memory

    case, job = CASES[name], job_of(CASES[name])
    request = Request(camera=case.camera, quality="draft", size=SIZE, spp=SAMPLES)
    film = frame_times(case.time, case.time + FRAMES / RATE, RATE)
    times = film if case.film else plan_times(job, request, case.time)
    begun = time.process_time()
    production = prepare(job, request, times)
    built = time.process_time()
    plain = production.quality.model_copy(update={"denoise": "none"})
    costs = {"build": round(built - begun, 2)}
    production = replace(production, quality=plain)
    with OpenShot(production) as shot:
        costs["open"] = round(time.process_time() - built, 2)
        for number, at in enumerate(film if case.film else [case.time]):
            start = time.process_time()
            still = shot.still(float(at))
            costs[f"picture {number}"] = round(time.process_time() - start, 2)
            still.save(folder / f"{name}.{number}.exr")
            still.save(folder / f"{name}.{number}.png")
    costs["memory [MB]"] = round(peak_memory())
    content = {"costs": costs, "built": _built(production, film if case.film else [case.time])}
    (folder / f"{name}.json").write_text(json.dumps(content, indent=1), encoding="utf-8")


def _built(production: Any, times: Sequence[float]) -> dict[str, Any]:
    """What was built for a picture, as digests by name."""
    from bench.processor_accounts import frame_account, world

    digests: dict[str, Any] = {}
    for key, value in world(production).items():
        own = np.ascontiguousarray(value)
        told = [str(own.shape), hashlib.sha256(own.tobytes()).hexdigest()[:16]]
        # Parts are numbered in their account; a number is no property of a part.
        digests[key.split(":", 1)[-1] if key[0].isdigit() else key] = told
    for at in times:
        for key, value in frame_account(production.shot.frame_at(float(at))).items():
            own = np.ascontiguousarray(value)
            told = [str(own.shape), hashlib.sha256(own.tobytes()).hexdigest()[:16]]
            digests[f"at {at:g}/{key}"] = told
    return digests


def compare(old: Path, new: Path, only: Sequence[str] = ()) -> Iterator[str]:
    """What differs between two stores, in words.

    Args:
        old: A folder of `store`.
        new: Another one.
        only: Parts of the names of the cases to compare; all if empty.
    """
    names = [
        {path.name for path in folder.glob("*.json") if _is_among(path.stem, only)}
        for folder in (old, new)
    ]
    for name in sorted(names[0] ^ names[1]):
        yield f"{Path(name).stem}: only in {(old if name in names[0] else new).name}"
    for name in sorted(names[0] & names[1]):
        path, other = old / name, new / name
        one, two = (json.loads(p.read_text(encoding="utf-8")) for p in (path, other))
        yield from (f"{path.stem}: {text}" for text in _changes(one["built"], two["built"]))
        pictures = {p.name for folder in (old, new) for p in folder.glob(f"{path.stem}.*.exr")}
        for picture in sorted(pictures):
            yield from _pixels(old / picture, new / picture)


def _is_among(name: str, only: Sequence[str]) -> bool:
    """Whether a case is asked for."""
    return not only or any(word in name for word in only)


def _changes(one: Mapping[str, Any], two: Mapping[str, Any]) -> Iterator[str]:
    """Names of what was built otherwise."""
    for key in sorted({*one, *two}):
        if one.get(key) != two.get(key):
            was, now = (some.get(key, ["nothing"])[0] for some in (one, two))
            yield f"{key}: {was} then, {now} now" if was != now else f"{key}: other values"


def _pixels(one: Path, two: Path) -> Iterator[str]:
    """How two pictures differ, with both and the difference beside the second."""
    from sumo3dviz_pt.image.exr import read_exr
    from sumo3dviz_pt.image.png import write_png

    if lacking := [path.parent.name for path in (one, two) if not path.exists()]:
        yield f"{one.name}: missing in {', '.join(lacking)}"
        return
    (old, _), (new, _) = read_exr(one), read_exr(two)
    if old.shape != new.shape:
        yield f"{one.name}: {old.shape} then, {new.shape} now"
    elif not np.array_equal(old, new):
        apart = np.abs(old.astype(np.float64) - new)
        count = int((apart.max(axis=2) > 0.0).sum())
        share, mean = count / (apart.size / 3), apart.mean() / max(float(old.mean()), 1e-12)
        yield f"{one.name}: {count} pixels ({share:.2%}), mean {mean:.2e} of the mean radiance"
        both = [_read_png(path.with_suffix(".png")) for path in (one, two)]
        gap = np.abs(both[0].astype(np.int16) - both[1]).astype(np.uint8)
        side = np.concatenate([*both, np.minimum(gap, 63) * 4], axis=1)
        write_png(two.with_name(f"{two.stem}.differs.png"), side)


def _read_png(path: Path) -> Any:
    """8-bit pixels, (h, w, 3)."""
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    return np.array(mi.Bitmap(str(path)))[..., :3]


def costs_of(old: Path, new: Path) -> Iterator[str]:
    """What each case cost then and now, in CPU-seconds."""
    for path in sorted(old.glob("*.json")):
        if (new / path.name).exists():
            one, two = (
                json.loads(p.read_text(encoding="utf-8"))["costs"] for p in (path, new / path.name)
            )
            told = (f"{key} {one[key]:g} -> {two.get(key, float('nan')):g}" for key in one)
            yield f"{path.stem}: {', '.join(told)}"


def store(folder: Path, only: Sequence[str]) -> None:
    """Render all cases, each in a process of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, case in CASES.items():
        if not _is_among(name, only):
            continue
        if case.scene in _RIDES and not SHARED.is_dir():
            print(f"{name}: left out, {SHARED.name} is not there", flush=True)
            continue
        begun = time.monotonic()
        subprocess.run([sys.executable, __file__, "take", str(folder), name], check=True)
        print(f"{name}: {time.monotonic() - begun:.0f} s", flush=True)


def main(arguments: Sequence[str]) -> int:
    """Store, or compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("store", "compare", "take"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("other", nargs="?", help="the second folder, or a case to take")
    parser.add_argument("--only", nargs="*", default=[], help="parts of the names")
    chosen = parser.parse_args(arguments)
    if chosen.what == "take":
        take(chosen.other, chosen.folder)
        return 0
    if chosen.what == "store":
        store(chosen.folder, chosen.only)
        return 0
    found = list(compare(chosen.folder, Path(chosen.other), chosen.only))
    print("\n".join(costs_of(chosen.folder, Path(chosen.other))))
    print("\n".join(found) if found else "nothing differs")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
