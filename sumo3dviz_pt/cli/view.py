"""`view`: serves a scene to walk through in the browser."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.cli.options import add_overrides, add_size, add_variant, add_window, overrides_of
from sumo3dviz_pt.errors import InstallationError

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import Job

log = logging.getLogger(__name__)


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser("view", help="walk through a scene in the browser")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--port", type=int, default=0, help="to listen on [a free one]")
    add_size(sub, (480, 270))
    add_window(sub)
    sub.add_argument("--token", help="the secret in the address [a new one each time]")
    add_variant(sub, ("llvm", "cuda"))
    add_overrides(sub)
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Show a scene until Ctrl-C."""
    from sumo3dviz_pt.pipeline.production import ready_renderer
    from sumo3dviz_pt.pipeline.scene_file import load_job
    from sumo3dviz_pt.viewer.render_thread import RenderThread
    from sumo3dviz_pt.viewer.server import serve

    chosen = overrides_of(options)
    if ready_renderer(options.variant).note:
        raise InstallationError("the viewer needs libLLVM or a graphics card")

    def reload(choices: Mapping[str, str]) -> Job:
        return load_job(options.scene, {**chosen, **choices})

    log.warning("opening %s: it is read, built and compiled in about a minute", options.scene)
    render_thread = RenderThread(
        reload({}),
        scene_file=options.scene,
        size=options.size,
        window=(options.start, options.end),
        variant=options.variant,
        reload=reload,
    )
    serve(
        render_thread,
        port=options.port,
        token=options.token,
        announce=lambda address: print(address, flush=True),
    )
    return 0
