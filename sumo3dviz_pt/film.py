"""Films: frames are the state that is kept, the film is made from them."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job import Job, ShotSettings
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.pipeline import (
    Production,
    Request,
    check_target,
    check_tone,
    frame_times,
    opened,
    prepare,
    provenance,
)
from sumo3dviz_pt.provenance import input_hashes, versions

FILM_SUFFIXES = (".mp4", ".mov", ".mkv")


@dataclass(frozen=True, slots=True)
class FrameDone:
    """News about a film being rendered.

    Attributes:
        done: Frames that exist now.
        total: Frames that were asked for.
        seconds_left: Estimate of the wall time left [s].
        kept: True if the frame was there already.
        cpu: CPU-seconds by phase; empty if kept.
    """

    done: int
    total: int
    seconds_left: float
    kept: bool
    cpu: dict[str, float]


@dataclass(frozen=True, slots=True)
class FilmOrder:
    """What `render` was asked for.

    Attributes:
        path: The film.
        start: First frame's time [s]; None is the shot's.
        end: After the last frame [s]; None is the shot's.
        fps: None is the scene file's.
        frames: First and after-last frame to render; None is all, and makes a film.
        resume: Whether matching frames are kept.
        discard_frames: Whether frames go when the film is done.
    """

    path: Path
    start: float | None = None
    end: float | None = None
    fps: float | None = None
    frames: tuple[int, int] | None = None
    resume: bool = False
    discard_frames: bool = False


@dataclass(frozen=True, slots=True)
class FilmReport:
    """What came out.

    Attributes:
        film: The film, or None if only frames were asked for.
        folder: Where the frames are (were).
        frames: How many frames it has.
        cpu: CPU-seconds by phase over all rendered frames.
    """

    film: Path | None
    folder: Path
    frames: int
    cpu: dict[str, float]


def shots_of(job: Job, request: Request, order: FilmOrder) -> list[tuple[ShotSettings, Path]]:
    """Shots to render and where each film goes.

    Raises:
        ConfigError: If times or cameras are missing, or several shots share a name.
    """
    if request.camera is not None or order.start is not None:
        return [(_asked_shot(job, request, order), order.path)]
    if not job.shots:
        raise ConfigError(
            "the scene has no shots; add one or give --camera, --from and --to", key="shots"
        )
    if len(job.shots) > 1 and "{shot}" not in order.path.name:
        raise ConfigError(
            f"the scene has {len(job.shots)} shots; put {{shot}} into the name of the output",
            key="output",
        )
    return [
        (shot, order.path.with_name(order.path.name.replace("{shot}", f"{number}_{shot.camera}")))
        for number, shot in enumerate(job.shots, start=1)
    ]


def _asked_shot(job: Job, request: Request, order: FilmOrder) -> ShotSettings:
    """The shot that the command describes."""
    from sumo3dviz_pt.jobfile import camera_settings

    name, _ = camera_settings(job, request.camera)
    of_file = next((shot for shot in job.shots if shot.camera == name), None)
    start = order.start if order.start is not None else (of_file.start if of_file else None)
    end = order.end if order.end is not None else (of_file.end if of_file else None)
    if start is None or end is None:
        raise ConfigError(f"the scene has no shot of {name!r}; give --from and --to", key="shots")
    if end <= start:
        raise ConfigError(f"--to ({end:g}) must be later than --from ({start:g})", key="to")
    return ShotSettings.model_validate({"camera": name, "from": start, "to": end})


def render_film(
    job: Job,
    request: Request,
    order: FilmOrder,
    *,
    on_frame: Callable[[FrameDone], None] | None = None,
) -> list[FilmReport]:
    """Render all shots that were asked for.

    Raises:
        ConfigError: Before any work, if something that was asked for is wrong.
        RenderError: If a frame fails; finished frames are kept.
    """
    fps = job.output.fps if order.fps is None else order.fps
    if not 0 < fps <= 240:
        raise ConfigError(f"must lie in (0, 240], not {fps:g}", key="fps")
    shots = shots_of(job, request, order)
    for _, path in shots:
        check_target(path, suffixes=FILM_SUFFIXES)
        check_output(request.applied(job), path, fps=fps)
    return [_render_shot(job, request, order, shot, path, on_frame) for shot, path in shots]


def check_output(job: Job, path: Path, *, fps: float) -> None:
    """Refuse what cannot be developed or encoded, before any work is done.

    Raises:
        ConfigError: If tone curve, codec, size or frame rate are wrong.
    """
    from sumo3dviz_pt.video import check_film

    check_tone(job.output.tone)
    check_film(path, size=job.output.size, fps=fps, codec=job.output.codec)


def _render_shot(
    job: Job,
    request: Request,
    order: FilmOrder,
    shot: ShotSettings,
    path: Path,
    on_frame: Callable[[FrameDone], None] | None,
) -> FilmReport:
    """Render one shot's frames and make its film."""
    from dataclasses import replace

    fps = job.output.fps if order.fps is None else order.fps
    times = frame_times(shot.start, shot.end, fps)
    wanted = _wanted(order.frames, len(times))
    production = prepare(job, replace(request, camera=shot.camera), times)
    folder = frames_folder(path)
    folder.mkdir(exist_ok=True)
    cpu = _render_frames(production, folder, wanted, resume=order.resume, on_frame=on_frame)
    if order.frames is not None:
        return FilmReport(None, folder, len(wanted), cpu)
    files = [frame_file(folder, number) for number in wanted]
    encode_frames(files, path, job=production.job, fps=fps)
    write_account(production, path, fps=fps)
    if order.discard_frames:
        shutil.rmtree(folder)
    return FilmReport(path, folder, len(wanted), cpu)


def _wanted(frames: tuple[int, int] | None, count: int) -> range:
    """Frame numbers to render."""
    first, after = frames if frames is not None else (0, count)
    if not 0 <= first < after <= count:
        raise ConfigError(f"{first}:{after} does not lie within 0:{count}", key="frames")
    return range(first, after)


def frames_folder(path: Path) -> Path:
    """Where a film's frames go."""
    return path.with_name(path.stem + ".frames")


def frame_file(folder: Path, number: int) -> Path:
    """A frame's file."""
    return folder / f"{number:06d}.exr"


def _render_frames(
    production: Production,
    folder: Path,
    wanted: Sequence[int],
    *,
    resume: bool,
    on_frame: Callable[[FrameDone], None] | None,
) -> dict[str, float]:
    """Render the frames that are missing; CPU-seconds by phase."""
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr

    missing = [
        number
        for number in wanted
        if not (resume and _is_done(production, frame_file(folder, number), number))
    ]
    total: dict[str, float] = {"read": production.reading}
    kept = len(wanted) - len(missing)
    if kept and on_frame is not None:
        on_frame(FrameDone(kept, len(wanted), 0.0, kept=True, cpu={}))
    if not missing:
        return total
    with opened(production, film=len(production.times) > 2) as session:
        started = time.monotonic()
        for count, number in enumerate(missing, start=1):
            at = float(production.times[number])
            rendered = session.render(production.shot.frame_at(at))
            account = {
                **provenance(production, frame=number, time=at),
                "capped_share": round(rendered.tally.capped_share, 6),
                "nonfinite": rendered.tally.nonfinite,
            }
            write_exr(
                frame_file(folder, number),
                rendered.radiance,
                half=production.job.output.half,
                attributes={PROVENANCE: json.dumps(account, sort_keys=True)},
            )
            for phase, seconds in rendered.cpu.items():
                total[phase] = total.get(phase, 0.0) + seconds
            if on_frame is not None:
                pace = (time.monotonic() - started) / count
                left = pace * (len(missing) - count)
                on_frame(FrameDone(kept + count, len(wanted), left, kept=False, cpu=rendered.cpu))
    return total


def _is_done(production: Production, path: Path, number: int) -> bool:
    """Whether a frame exists and is just what would be rendered."""
    from sumo3dviz_pt.image.exr import PROVENANCE, read_exr

    if not path.exists():
        return False
    try:
        _, attributes = read_exr(path)
        account = json.loads(attributes.get(PROVENANCE, "{}"))
    except (InputError, ValueError):
        return False
    same_time = abs(float(account.get("time", np.inf)) - float(production.times[number])) < 1e-9
    return bool(account.get("key") == production.key and same_time)


def encode_frames(
    files: Sequence[Path],
    path: Path,
    *,
    job: Job,
    fps: float,
    exposure: float | None = None,
) -> None:
    """Develop stored frames and encode them in constant memory.

    Args:
        files: EXR frames, in order.
        path: The film.
        job: Size, codec and tone.
        fps: Frames per second.
        exposure: EV instead of that stored with the frames.
    """
    from sumo3dviz_pt.video import encode

    pictures = developed(files, tone=job.output.tone, exposure=exposure)
    encode(
        pictures,
        path,
        size=job.output.size,
        fps=fps,
        codec=job.output.codec,
        comment={"made_by": "sumo3dviz_pt", "versions": versions()},
    )


def developed(
    files: Sequence[Path], *, tone: str | None, exposure: float | None
) -> Iterator[Image]:
    """Stored frames as display-encoded pictures; None takes what is stored with them."""
    from sumo3dviz_pt.image.exr import PROVENANCE, read_exr
    from sumo3dviz_pt.image.tonemap import develop_float

    for file in files:
        radiance, attributes = read_exr(file)
        account = json.loads(attributes.get(PROVENANCE, "{}"))
        stored = float(account.get("exposure", 0.0))
        yield develop_float(
            radiance,
            exposure=stored if exposure is None else exposure,
            tone=tone or str(account.get("tone", "neutral")),
            glare=float(account.get("glare", 0.0)),
        )


def write_account(production: Production, path: Path, *, fps: float) -> None:
    """Write the JSON beside a film: what every frame shows."""
    frames = []
    states: dict[str, str] = {}
    changes = []
    for number, at in enumerate(production.times):
        frame = production.shot.frame_at(float(at))
        frames.append(_frame_account(number, frame))
        now = production.shot.states_at(float(at))
        changes += [
            {"frame": number, "time": float(at), "tls": tls, "state": state}
            for tls, state in sorted(now.items())
            if states.get(tls) != state
        ]
        states = now
    job = production.job
    account = {
        "film": path.name,
        "fps": fps,
        "size": list(job.output.size),
        "camera": production.camera,
        "seed": job.seed,
        "quality": job.quality,
        "spp": production.quality.spp,
        "exposure": production.exposure,
        "tone": job.output.tone,
        "glare": job.output.glare,
        "inputs": input_hashes(production.files),
        "versions": versions(),
        "left_out": [
            {"what": item.what, "why": item.why} for item in production.shot.data.left_out
        ],
        "signal_changes": changes,
        "frames": frames,
    }
    target = path.with_suffix(".json")
    part = target.with_name(target.name + ".part")
    part.write_text(json.dumps(account, indent=1), encoding="utf-8")
    part.replace(target)


def _frame_account(number: int, frame: FrameState) -> dict[str, Any]:
    """What one frame shows."""
    view = frame.view
    matrix = view.world_from_camera.matrix
    return {
        "frame": number,
        "time": frame.time,
        "camera": {
            "position": [round(float(value), 6) for value in view.position],
            "forward": [round(float(value), 9) for value in matrix[:3, 0]],
            "up": [round(float(value), 9) for value in matrix[:3, 2]],
            "fov": round(float(np.degrees(view.fov)), 6),
        },
        "drawn": sorted(frame.users),
    }
