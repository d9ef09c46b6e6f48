"""Renders films: frames are stored one by one, and the film is made from them.

`plans` says what would be done, without building or rendering anything; the log is read.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import Job, ShotSettings
from sumo3dviz_pt.model.numbers import in_short
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.accounts import film_account
from sumo3dviz_pt.pipeline.conditions import film_cost, forecast_factor, lacking
from sumo3dviz_pt.pipeline.costs import (
    TYPICAL_TRIANGLES,
    Cost,
    rates_of,
    space_in_words,
    spent,
    time_in_words,
)
from sumo3dviz_pt.pipeline.films.encoding import encode_frames, files_beside, noted, sealed
from sumo3dviz_pt.pipeline.films.frames import (
    NOTE,
    SUFFIX,
    account_file,
    check_sequence,
    frame_file,
    frames_folder,
    is_sequence,
    masters_folder,
    numbered,
    read_account,
    traced_on,
    write_json,
)
from sumo3dviz_pt.pipeline.films.heard import check_play, is_heard, write_recording
from sumo3dviz_pt.pipeline.films.orders import FilmOrder as FilmOrder
from sumo3dviz_pt.pipeline.films.orders import Pace, ShotFilm, shots_of, wanted_frames
from sumo3dviz_pt.pipeline.films.overlays import extra_files, extra_frames, note_overlays
from sumo3dviz_pt.pipeline.films.pilot import piloted
from sumo3dviz_pt.pipeline.films.rendering import FrameDone as FrameDone
from sumo3dviz_pt.pipeline.films.rendering import Frames
from sumo3dviz_pt.pipeline.films.reuse import alone, check_unused, discard, missing_frames
from sumo3dviz_pt.pipeline.films.sound import recording_file, sound_folder, write_tracks
from sumo3dviz_pt.pipeline.metering import metered
from sumo3dviz_pt.pipeline.production import (
    Production,
    Request,
    check_target,
    check_tone,
    check_window,
    get_ready,
    prepare,
    ready_renderer,
    scenario_files,
    within_log,
)
from sumo3dviz_pt.pipeline.reading import check_companions, read_files, spare_inputs
from sumo3dviz_pt.pipeline.scene_file import quality_preset
from sumo3dviz_pt.video.codecs import FILM_SUFFIXES as FILM_SUFFIXES


@dataclass(frozen=True, slots=True)
class FilmReport:
    """What was rendered for one shot.

    Attributes:
        film: The film, or None if only frames were asked for.
        folder: Where the frames are (were).
        frames: How many frames it has.
        cpu: CPU-seconds by phase; together all that it took.
    """

    film: Path | None
    folder: Path
    frames: int
    cpu: dict[str, float]


def render_film(
    job: Job,
    request: Request,
    order: FilmOrder,
    *,
    on_frame: Callable[[FrameDone], None] | None = None,
) -> list[FilmReport]:
    """Render all shots that were asked for.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.
        on_frame: Called after every frame.

    Raises:
        ConfigError: Before any work, if something that was asked for is wrong.
        InstallationError: Before any work, if the renderer cannot be loaded.
        RenderError: If a frame fails; finished frames are kept.
    """
    shots = check_order(job, request, order)
    check_places(job, order, shots)
    get_ready(job, request)
    check_layers(job, request)
    if len(shots) > 1:  # a single shot is checked as soon as the log is read
        check_rides(job, order, shots)
    return [_render_shot(job, request, order, shot, path, on_frame) for shot, path in shots]


def check_order(job: Job, request: Request, order: FilmOrder) -> list[ShotFilm]:
    """Refuse an order that cannot be carried out, before any work is done.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Returns:
        Shots to render and where each film goes.

    Raises:
        ConfigError: If something that was asked for is wrong.
    """
    shots = shots_of(job, request, order)
    spare_inputs(job, *(path for _, path in shots))
    for shot, path in shots:
        check_target(path, suffixes=(*FILM_SUFFIXES, SUFFIX), overwrite=True)
        check_output(request.applied(job), path, fps=order.pace(job, shot).fps)
        check_play(job, order.pace(job, shot))
    return shots


def check_layers(job: Job, request: Request) -> None:
    """Refuse layers that the renderer cannot find, before any work is done.

    Args:
        job: The scene file.
        request: The command's choices.

    Raises:
        ConfigError: If layers are asked for, and the variant does not compile.
    """
    if job.output.layers and not ready_renderer(request.variant).jit:
        raise ConfigError(
            f"the variant {request.variant} has no layers; take llvm", key="output.layers"
        )


def check_rides(job: Job, order: FilmOrder, shots: Sequence[ShotFilm]) -> None:
    """Refuse rides with road users that are not there; the log is searched once for each.

    Args:
        job: The scene file.
        order: Frame rate and speed.
        shots: Each with its film.

    Raises:
        ConfigError: Says when the log has them.
        InputError: If there is no log.
    """
    films = [(shot, order.pace(job, shot).times(shot)) for shot, _ in shots]
    check_companions(job, films, scenario_files(job).trajectories)


def check_places(job: Job, order: FilmOrder, shots: Sequence[ShotFilm]) -> None:
    """Refuse to overwrite what exists, unless the order says so.

    Args:
        job: The scene file.
        order: What may be kept or replaced.
        shots: Each with its film.

    Raises:
        ConfigError: If a film is being rendered there, or anything would be overwritten.
    """
    for shot, path in shots:
        count = len(order.pace(job, shot).times(shot))
        also = extra_files(path, job.overlays)
        also += [sound_folder(path)] if job.output.sound else []
        also += [recording_file(path)] if is_heard(job) else []
        check_unused(path, order, count=count, also=also)


def check_output(job: Job, path: Path, *, fps: Fraction) -> None:
    """Refuse what cannot be developed or encoded, before any work is done.

    Args:
        job: The scene file.
        path: The film, or its numbered pictures.
        fps: Frames per second.

    Raises:
        ConfigError: If tone curve, codec, size or frame rate are wrong.
    """
    from sumo3dviz_pt.video import check_film

    check_tone(job.output.tone)
    check_sequence(path)
    if is_sequence(path):
        return
    check_film(path, size=job.output.size, fps=fps, codec=job.output.codec)


def prepared(job: Job, request: Request, order: FilmOrder) -> Production:
    """Return the first shot that was asked for, ready to be rendered.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError: If something that was asked for is wrong.
        InputError: If a file is wrong.
    """
    shot, _ = shots_of(job, request, order)[0]
    get_ready(job, request)
    return piloted(_production(job, request, order, shot), request)


def _production(job: Job, request: Request, order: FilmOrder, shot: ShotSettings) -> Production:
    """Return a shot, ready to be rendered."""
    times = order.pace(job, shot).times(shot)
    # A frame alone has no help, and only our own kernel knows what a pixel shows. Frames say what
    # traces them, which where there is no libLLVM is not what was asked for.
    backend = ready_renderer(request.variant)
    together = len(times) > 1 and backend.jit
    own = replace(request, camera=shot.camera, variant=backend.name)
    made = prepare(job, own, times, film=True, together=together)
    return metered(made, request.metered)


def _render_shot(
    job: Job,
    request: Request,
    order: FilmOrder,
    shot: ShotSettings,
    path: Path,
    on_frame: Callable[[FrameDone], None] | None,
) -> FilmReport:
    """Render one shot's frames and make its film."""
    started, pace = spent(), order.pace(job, shot)
    wanted_frames(order.frames, len(pace.times(shot)))
    with nullcontext() if order.frames else alone(path):
        folder = frames_folder(path)
        production = _production(job, request, order, shot)
        production = piloted(production, request, folder=folder)
        wanted = wanted_frames(order.frames, len(production.times))
        folder.mkdir(exist_ok=True)
        shared = {**production.account, "shot": _shot(production, pace)}
        missing = missing_frames(production, folder, wanted, order, shared)
        write_json(folder / NOTE, shared, indent=1)
        note_overlays(folder, production, rate=float(pace.fps))
        cpu = {"read": production.reading}
        frames = Frames(production, folder, wanted, missing, shared, on_frame)
        frames.tell_kept()
        if order.frames is not None or not order.discard_frames:
            deque(frames.rendered(cpu), maxlen=0)
        if order.frames is not None:
            return FilmReport(None, folder, len(wanted), _with_rest(cpu, started))
        heard = write_recording(path, production, pace)
        digests, films = _make_film(frames, path, order, pace, cpu)
        whole = film_account(production, path.name, shared=shared, pace=pace.account())
        whole |= heard | _overlays(production.job, path, float(pace.fps)) | _denoiser(production)
        whole |= _devices(frames.files) if order.mix_devices else {}
        beside = files_beside(path, frames.files, heard=bool(heard))
        whole |= {"files": digests | beside, "delivered": films}
        write_json(account_file(path), sealed(whole), indent=1)
        if order.discard_frames:
            discard(folder, wanted)
    return FilmReport(path, folder, len(wanted), _with_rest(cpu, started))


def _denoiser(production: Production) -> dict[str, str]:
    """Return where a GPU's pictures were denoised: on it or on the processor."""
    from sumo3dviz_pt.render.passes.finish import denoiser_device

    if not production.device or production.quality.denoise == "none":
        return {}
    return {"denoised_on": denoiser_device()}


def _devices(files: Iterable[Path]) -> dict[str, list[str]]:
    """Return what traced a film's frames, where that is more than one device."""
    devices = sorted({traced_on(read_account(file)) for file in files if file.is_file()})
    return {"devices": devices} if len(devices) > 1 else {}


def _overlays(job: Job, path: Path, rate: float) -> dict[str, Any]:
    """Return what a film's account says of overlays; nothing where it has none."""
    if job.overlays is None:
        return {}
    before, after = (0, 0) if is_sequence(path) else extra_frames(job.overlays, rate)
    names = [file.name for file in extra_files(path, job.overlays)]
    return {"overlays": {"files": names, "frames_before": before, "frames_after": after}}


def _make_film(
    frames: Frames, path: Path, order: FilmOrder, pace: Pace, cpu: dict[str, float]
) -> tuple[dict[str, str], dict[str, Any]]:
    """Make a film of its frames, and its tracks; frames that do not stay are rendered as it asks.

    Returns:
        The frames' digests, and what the film can be held against.
    """
    masters = masters_folder(path) if order.final_exr else None
    if masters is not None:
        masters.mkdir(exist_ok=True)
    digests: dict[str, str] = {}
    if not order.discard_frames:
        announce(Doing.ENCODE)
    with frames.turns(cpu, discard=order.discard_frames) as turns:
        films = encode_frames(
            frames.files,
            path,
            production=frames.production,
            fps=pace.fps,
            masters=masters,
            turns=noted(turns, digests),
        )
    if frames.layers is not None:
        frames.layers.finish()
    write_tracks(path, frames.production, pace)
    return digests, films


def _with_rest(cpu: Mapping[str, float], started: float) -> dict[str, float]:
    """Return the CPU-seconds by phase, and what no phase counts: files, the encoder's program."""
    return {**cpu, "rest": max(spent() - started - sum(cpu.values()), 0.0)}


def _shot(production: Production, pace: Pace) -> dict[str, Any]:
    """Return a film's window as its frames tell it."""
    times = production.times
    return {"from": float(times[0]), **pace.account(), "frames": len(times)}


_OF_ONE_CARD = (
    "these times are those of an H200; `sumo3dviz-pt doctor --frame` measures this machine's GPU"
)


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be done for one shot.

    Attributes:
        path: The film.
        shot: Camera and times.
        pace: Frame rate and speed.
        size: Width, height [px].
        quality: The preset's name.
        wanted: Numbers of the frames that are asked for.
        stored: How many of these lie there already, whatever they show.
        film_exists: Whether the film does.
        cost: Forecast of all frames, as if none were there.
        variant: What traces.
        wish: What a pilot would choose the samples by; empty if the preset does.
    """

    path: Path
    shot: ShotSettings
    pace: Pace
    size: tuple[int, int]
    quality: str
    wanted: range
    stored: int
    film_exists: bool
    cost: Cost
    variant: str
    wish: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        width, height = self.size
        speed = "" if self.pace.speed == 1 else f", speed {in_short(self.pace.speed)}"
        part = "" if self.wanted.start == 0 else f" from number {self.wanted.start}"
        cost, meter = self.cost, "GPU" if self.variant == "cuda" else "CPU"
        lines = [
            f"{self.path}",
            f"  shot    {self.shot.camera},"
            f" {self.shot.start:.12g} to {self.shot.end:.12g} s{speed}",
            f"  frames  {len(self.wanted)}{part}, {width}x{height},"
            f" {in_short(self.pace.fps)} a second, {self.quality}",
            f"  there   {self.stored} of these frames in {frames_folder(self.path)};"
            f" the film {'exists' if self.film_exists else 'does not exist'}",
            f"  cost    about {time_in_words(3600 * cost.cpu_hours)} of {meter} time,"
            f" {time_in_words(cost.wall_seconds)} here, {space_in_words(cost.memory_mb)} of memory,"
            f" {space_in_words(cost.frames_mb)} of frames, {space_in_words(cost.film_mb)} of film",
        ]
        lines += [f"  note    {what}" for what in lacking(cost, self.path)]
        if self.variant == "cuda":
            lines.append(f"  note    {_OF_ONE_CARD}")
        for name, value in self.wish.items():
            lines.append(f"  pilot   chooses other samples than the preset's: {name} {value:g}")
        return "\n".join(lines)


def plans(job: Job, request: Request, order: FilmOrder) -> list[Plan]:
    """Return what would be done, shot by shot.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError: If something that was asked for is wrong, as `render_film` would.
        InputError: If the simulation's files are not there.
    """
    applied = request.applied(job)
    planned = []
    shots = check_order(job, request, order)
    check_rides(job, order, shots)
    for shot, path in shots:
        pace, count = order.pace(job, shot), frames_in_log(job, order, shot)
        wanted = wanted_frames(order.frames, count)
        folder = frames_folder(path)
        film = numbered(path, wanted.start) if is_sequence(path) else path
        cost = film_cost(
            quality_preset(applied.quality, spp=request.spp, together=count > 1),
            applied.output,
            triangles=TYPICAL_TRIANGLES,
            frames=len(wanted),
            factor=forecast_factor(applied),
            rates=rates_of(request.variant),
        )
        planned.append(
            Plan(
                path,
                shot,
                pace,
                applied.output.size,
                applied.quality,
                wanted,
                sum(frame_file(folder, number).exists() for number in wanted),
                film.exists(),
                cost,
                request.variant,
                request.wish,
            )
        )
    return planned


def frames_in_log(job: Job, order: FilmOrder, shot: ShotSettings) -> int:
    """Return how many frames a film has: it ends where the log does, with a note.

    Args:
        job: The scene file.
        order: Which shots, and when.
        shot: One of them.

    Raises:
        ConfigError: If it begins before the log, or all of it lies after that.
        InputError: If a file of the simulation is wrong.
    """
    times = order.pace(job, shot).times(shot)
    _, scenario = read_files(job, begin=float(times[0]), end=float(times[-1]))
    check_window(scenario, times)
    return len(within_log(scenario, times))
