"""`sumo3dviz-pt view`: from the command line's choices to a page that answers."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Callable, Mapping

from sumo3dviz_pt.arguments import overrides_of
from sumo3dviz_pt.job import Job
from sumo3dviz_pt.jobfile import load_job
from sumo3dviz_pt.viewer.server import serve
from sumo3dviz_pt.viewer.studio import Studio

log = logging.getLogger(__name__)


def view(options: argparse.Namespace, *, announce: Callable[[str], None]) -> None:
    """Show a scene until Ctrl-C.

    Args:
        options: Of the command line.
        announce: Told the page's address as soon as it answers.

    Raises:
        InputError: If a file is wrong.
        ConfigError: If a choice is.
    """
    chosen = overrides_of(options)

    def reload(choices: Mapping[str, str]) -> Job:
        return load_job(options.scene, {**chosen, **choices})

    log.warning("opening %s: it is read, built and compiled in about a minute", options.scene)
    studio = Studio(
        reload({}),
        scene_file=options.scene,
        size=options.size,
        window=(options.start, options.end),
        variant=options.variant,
        reload=reload,
    )
    serve(studio, port=options.port, token=options.token, announce=announce)
