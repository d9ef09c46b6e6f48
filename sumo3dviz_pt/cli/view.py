"""`view`: serves a scene, or a simulation that runs meanwhile, to walk through in the browser.

Of a simulation, SUMO's first minutes are recorded beforehand: they tell which cameras to propose,
which bodies to load, and how many road users there must be room for.
"""

from __future__ import annotations

import argparse
import logging
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.export import add_fps, run_static
from sumo3dviz_pt.cli.options import (
    add_overrides,
    add_overwrite,
    add_size,
    add_variant,
    add_window,
    overrides_of,
)
from sumo3dviz_pt.errors import ConfigError, InstallationError, MissingExtraError

if TYPE_CHECKING:
    from socket import socket

    from sumo3dviz_pt.job.settings import Job
    from sumo3dviz_pt.viewer.running import Running

log = logging.getLogger(__name__)

_SURVEY = 300.0
"""Time of a simulation that is looked at beforehand [s]."""

_DELAY = 12.0
"""How far a run of our own is ahead of what is shown [s]: the margin with which films read logs.
Nobody else waits for it, and SUMO is far faster than pictures, so it costs nothing."""

_ENDINGS = (".sumocfg", ".sumo.cfg")


def add_view(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "view", help="walk through a scene, or a running simulation, in the browser"
    )
    sub.add_argument("scene", type=Path, help="a scene file, or a .sumocfg that runs meanwhile")
    sub.add_argument("--port", type=int, default=0, help="to listen on [a free one]")
    add_size(sub, (480, 270))
    add_window(sub)
    sub.add_argument("--token", help="the secret in the address [a new one each time]")
    add_variant(sub, ("llvm", "cuda"))
    live = sub.add_argument_group("with a .sumocfg")
    live.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="keep what was seen, as `record` would"
    )
    live.add_argument("--seed", type=int, help="SUMO's seed instead of the configuration's")
    live.add_argument(
        "--delay",
        type=float,
        metavar="S",
        help=f"how far pictures are behind the simulation [{_DELAY:g} s, as films need]",
    )
    page = sub.add_argument_group("without a server")
    page.add_argument(
        "--static", type=Path, metavar="FOLDER", help="write a page that needs none, and end"
    )
    add_fps(page)
    add_overwrite(sub, "replace a recording or a page that is there")
    add_overrides(sub)
    sub.set_defaults(run=run_view)


def run_view(options: argparse.Namespace) -> int:
    """Show a scene until Ctrl-C, or write a page of it."""
    from sumo3dviz_pt.pipeline.production import ready_renderer

    _check(options)
    if options.static is not None:
        return run_static(options)
    from sumo3dviz_pt.viewer.server import heeded_signals, listening

    with heeded_signals(), listening(options.port, key="--port") as line:
        if ready_renderer(options.variant).note:
            raise InstallationError("the viewer needs libLLVM or a graphics card")
        if options.scene.name.endswith(_ENDINGS):
            with _running(options) as opened:
                return _serve(options, opened, line)
        return _serve(options, _Opened(options.scene), line)


def _check(options: argparse.Namespace) -> None:
    """Refuse options that do not go with what is viewed.

    Raises:
        ConfigError: Names the option.
    """
    from sumo3dviz_pt.viewer.choices import MOST_DELAY

    runs = options.scene.name.endswith(_ENDINGS)
    if runs and options.static is not None:
        raise ConfigError("shows a scene file, not a simulation that runs", key="--static")
    if runs and options.end is not None:
        raise ConfigError("a running simulation ends where its .sumocfg says", key="--to")
    if runs and options.delay is not None and not 0.0 <= options.delay <= MOST_DELAY:
        raise ConfigError(f"must lie in 0..{MOST_DELAY:g} s, not {options.delay:g}", key="--delay")
    for name in () if runs else ("keep", "seed", "delay"):
        if getattr(options, name) is not None:
            raise ConfigError("only goes with a .sumocfg, which runs meanwhile", key=f"--{name}")


@dataclass(frozen=True, slots=True)
class _Opened:
    """What is served.

    Attributes:
        scene: The scene file.
        recording: Configuration of the recording that it shows instead of its own simulation;
            None is its own.
        saved: Where cameras are saved; None shows them as text.
        running: The simulation, if it runs.
    """

    scene: Path
    recording: Path | None = None
    saved: Path | None = None
    running: Running | None = None

    def job(self, choices: Mapping[str, str]) -> Job:
        """Read the scene file with further choices, by dotted key."""
        from sumo3dviz_pt.pipeline.scene_file import load_job

        job = load_job(self.scene, choices)
        if self.recording is None:
            return job
        none = {"folder": None, "network": None, "trajectories": (), "signals": ()}
        scenario = job.scenario.model_copy(update={"sumocfg": self.recording, **none})
        return job.model_copy(update={"scenario": scenario})


def _serve(options: argparse.Namespace, opened: _Opened, line: socket) -> int:
    """Show what was opened until Ctrl-C, on a line that listens."""
    from sumo3dviz_pt.viewer.render_thread import RenderThread
    from sumo3dviz_pt.viewer.server import serve

    chosen = overrides_of(options)

    def reload(choices: Mapping[str, str]) -> Job:
        return opened.job({**chosen, **choices})

    log.warning("opening %s: it is read, built and compiled in about a minute", options.scene)
    render_thread = RenderThread(
        reload({}),
        scene_file=opened.saved if opened.running else opened.scene,
        size=options.size,
        window=opened.running or (options.start, options.end),
        variant=options.variant,
        reload=reload,
    )
    serve(
        render_thread,
        port=line,
        token=options.token,
        announce=lambda address: print(address, flush=True),
    )
    return 0


@contextmanager
def _running(options: argparse.Namespace) -> Iterator[_Opened]:
    """Start a simulation; at the end, finish its recording, or remove it.

    Raises:
        MissingExtraError: If there is no SUMO.
    """
    from sumo3dviz_pt.pipeline.reading import Ground
    from sumo3dviz_pt.recording.feeds import RunFeed
    from sumo3dviz_pt.recording.files import RecordOrder
    from sumo3dviz_pt.recording.live_log import LiveLog
    from sumo3dviz_pt.recording.run import check_folder
    from sumo3dviz_pt.recording.stepped import SteppedRun
    from sumo3dviz_pt.viewer.running import Running

    with tempfile.TemporaryDirectory(prefix="sumo3dviz_pt-") as name, ExitStack() as held:
        keep = options.keep
        if keep is not None:
            order = RecordOrder(keep, overwrite=options.overwrite)
            check_folder(order, options.scene, key="--keep")
            held.enter_context(_place_of(keep))
        opened = _surveyed(options, Path(name))
        job = opened.job(overrides_of(options))
        ground = replace(Ground.of(job), growing=True)
        delay = _DELAY if options.delay is None else options.delay
        run = SteppedRun(options.scene, keep or Path(name, "seen"), seed=options.seed)
        try:
            log = LiveLog(job, ground, delay=delay, start=options.start)
            feed = RunFeed(run, log, start=options.start)
            title = options.scene.name.removesuffix(".sumocfg").removesuffix(".sumo.cfg")
            yield replace(opened, running=Running(ground, feed, title=title))
        finally:
            kept = run.close()
            if keep is not None and kept is not None:
                print(f"kept {kept}; scene: {opened.scene}", flush=True)


@contextmanager
def _place_of(keep: Path) -> Iterator[None]:
    """Make a folder; if no recording comes to it, it is as before."""
    from sumo3dviz_pt.recording.files import LOG

    scene, new = keep / "scene.yaml", not keep.exists()
    own = scene.exists()
    keep.mkdir(parents=True, exist_ok=True)
    try:
        yield
    finally:
        if not (keep / LOG).exists():
            if not own:
                scene.unlink(missing_ok=True)
            if new and not any(keep.iterdir()):
                keep.rmdir()


def _surveyed(options: argparse.Namespace, folder: Path) -> _Opened:
    """Record the first minutes of a simulation aside, and find or propose its scene.

    What is kept holds nothing of them, as nobody sees them.
    """
    from sumo3dviz_pt.files.atomic import write_atomically
    from sumo3dviz_pt.proposals.proposal import propose, quoted_path
    from sumo3dviz_pt.recording.command import read_settings
    from sumo3dviz_pt.recording.files import LOG, SIGNALS, RecordOrder
    from sumo3dviz_pt.recording.run import record, sumo_program

    try:
        sumo_program()
    except InstallationError as error:
        raise MissingExtraError("to view a running simulation needs SUMO", extra="sumo") from error
    begin = read_settings(options.scene).begin if options.start is None else options.start
    log.warning("SUMO runs %g s of %s, to see what there is", _SURVEY, options.scene)
    order = RecordOrder(folder, options.start, begin + _SURVEY, seed=options.seed)
    recording = record(options.scene, order)[0]
    own = options.scene.with_name("scene.yaml")
    if own.is_file():
        log.warning("the scene is %s", own)
        return _Opened(own, recording, saved=own)
    scene = (options.keep or folder) / "scene.yaml"
    text, _ = propose(recording, output=scene)
    for name in (LOG, SIGNALS):  # where they will lie
        text = text.replace(quoted_path(folder / name, scene.parent), f'"{name}"')
    write_atomically(scene, text)
    return _Opened(scene, recording, saved=scene if options.keep is not None else None)
