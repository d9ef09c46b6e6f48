"""A scene's cameras, as a mapping that shows itself in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sumo3dviz_pt.job.settings import CameraSettings


class Cameras(Mapping[str, CameraSettings]):
    """Cameras by name."""

    def __init__(self, cameras: Mapping[str, CameraSettings]) -> None:
        self._cameras = dict(cameras)

    def __getitem__(self, name: str) -> CameraSettings:
        return self._cameras[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._cameras)

    def __len__(self) -> int:
        return len(self._cameras)

    def __repr__(self) -> str:
        width = max(map(len, self._cameras), default=0)
        lines = [f"{name:<{width}}  {self[name].in_words()}" for name in self]
        return "\n".join(lines) or "no cameras"
