"""Recording from Python: follow a simulation in your own loop, and make a scene of it."""

from __future__ import annotations

from sumo3dviz_pt.pipeline.recording.recorder import Recorder as Recorder
