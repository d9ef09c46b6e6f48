"""Physically based, path-traced stills and films of SUMO traffic simulations.

import sumo3dviz_pt as sv

scene = sv.load("scene.yaml")
scene.still(time=12.0, camera="driver", quality="preview").save("still.png")
"""

from __future__ import annotations

from sumo3dviz_pt.api import Scene, Study, example, load, read_layers
from sumo3dviz_pt.errors import (
    ConfigError,
    InputError,
    InstallationError,
    RenderError,
    Sumo3dvizError,
)
from sumo3dviz_pt.live_view import LiveView, Observer
from sumo3dviz_pt.recording.recorder import Recorder

__all__ = [
    "ConfigError",
    "InputError",
    "InstallationError",
    "LiveView",
    "Observer",
    "Recorder",
    "RenderError",
    "Scene",
    "Study",
    "Sumo3dvizError",
    "example",
    "load",
    "read_layers",
]

__version__ = "0.1.0"
