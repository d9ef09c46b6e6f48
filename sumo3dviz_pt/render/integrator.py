"""An integrator, and the layers that it finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sumo3dviz_pt.model.layers import Channels


@dataclass(frozen=True, slots=True, eq=False)
class Integrator:
    """What traces a picture.

    Attributes:
        plugin: Mitsuba's object.
        channels: Where the layers lie in the pictures that it traces.
    """

    plugin: Any
    channels: Channels
