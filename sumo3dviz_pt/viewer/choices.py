"""What can be chosen of a viewer; importing it loads nothing heavy."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from sumo3dviz_pt.job.errors import settle
from sumo3dviz_pt.job.values import WIDEST, Finite, Seconds, Size, Whole

MOST_DELAY = 16.0
"""How far pictures may be behind a running simulation [s]: the time that is made ready ahead of
pages, and the margin that smoothing needs behind them, have to lie in the window, too."""


@dataclass(frozen=True, slots=True)
class ViewerOutlook:
    """What a viewer shows.

    Attributes:
        size: Of its pictures [px].
        start: First time [s]; None is the log's.
        end: Last time [s]; None is the log's.
        variant: `llvm` or `cuda`.
    """

    size: Size
    start: Seconds | None
    end: Seconds | None
    variant: str

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)


@dataclass(frozen=True, slots=True)
class LiveChoices:
    """What a viewer shows of somebody's running simulation, and how it listens.

    Attributes:
        keep: Folder of a recording; None keeps none.
        overwrite: Whether a recording that is there is replaced.
        delay: How far pictures are behind the last step [s].
        port: To listen on; 0 takes a free one.
        size: Of its pictures [px].
        variant: `llvm` or `cuda`.
    """

    keep: Path | None = None
    overwrite: bool = False
    delay: Annotated[Finite, Field(ge=0, le=MOST_DELAY)] = 2.0
    port: Annotated[Whole, Field(ge=0, le=65535)] = 0
    size: Size = (480, 270)
    variant: str = "llvm"

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)


@dataclass(frozen=True, slots=True)
class Choices:
    """How a viewer listens and looks.

    Attributes:
        port: To listen on; 0 takes a free one.
        token: The secret in the address; None makes one up.
        height: Of the frame in a notebook [px]; None fits the picture.
        proxy: Address at which the notebook's server passes this machine's ports on, with
            `{port}` in it; None looks for JupyterHub's, empty stays on this machine.
    """

    port: Annotated[Whole, Field(ge=0, le=65535)] = 0
    token: str | None = None
    height: Annotated[Whole, Field(ge=1, le=WIDEST)] | None = None
    proxy: str | None = None

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)

    @property
    def way(self) -> str:
        """Return the proxy's address, or nothing where a browser on this machine is meant.

        References:
            JupyterHub sets JUPYTERHUB_SERVICE_PREFIX, and jupyter-server-proxy answers at
            `proxy/PORT/` below it (their manuals).
        """
        if self.proxy is not None:
            return self.proxy
        hub = os.environ.get("JUPYTERHUB_SERVICE_PREFIX")
        return f"{hub.rstrip('/')}/proxy/{{port}}/" if hub else ""
