"""What the render thread tells a page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Frame:
    """A picture; a newer one may replace it while it waits.

    Attributes:
        info: `seq` and what is said about it.
        jpeg: The file.
    """

    info: dict[str, Any]
    jpeg: bytes


@dataclass(frozen=True, slots=True)
class Note:
    """Anything else; none gets lost.

    Attributes:
        content: With its `kind`.
    """

    content: dict[str, Any]


Message = Frame | Note
