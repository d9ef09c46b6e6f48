"""Films that were rendered, as a list that notebooks show."""

from __future__ import annotations

import base64
import html
from pathlib import Path

_LARGEST = 20_000_000
"""Films up to this size are put into the notebook itself [bytes]."""

_TYPES = {".mp4": "video/mp4", ".mov": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}


class Films(list[Path]):
    """Paths of films; the last line of a notebook's cell shows them."""

    def _repr_html_(self) -> str:
        """Return every film as a player, or as its name if it is too large or is no film."""
        return "\n".join(map(_shown, self))


def _shown(path: Path) -> str:
    """Return one film in HTML."""
    kind, name = _TYPES.get(path.suffix.lower()), html.escape(str(path))
    if kind is None or not path.is_file() or path.stat().st_size > _LARGEST:
        return f"<p><code>{name}</code></p>"
    data = f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"
    if kind.startswith("image"):
        return f'<img src="{data}" alt="{name}" style="max-width: 100%">'
    return f'<video src="{data}" title="{name}" controls loop style="max-width: 100%"></video>'
