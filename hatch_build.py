"""Makes the README fit an index: its links lead to the repository, at the tag of this version."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(!\[[^\[\]]*)?\]\((?!https?:|#)([^)\s]+)\)")


class ReadmeForAnIndex(MetadataHookInterface):
    """Writes the long description; the address is `Repository` of `[project.urls]`."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the README with absolute links."""
        base, tag = metadata["urls"]["Repository"], f"v{metadata['version']}"

        def absolute(link: re.Match[str]) -> str:
            picture, place = link.groups(default="")
            return f"{picture}]({base}/{'raw' if picture else 'blob'}/{tag}/{place})"

        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": _LINK.sub(absolute, text)}
