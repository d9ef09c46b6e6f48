"""A scene's cameras, as a mapping that shows itself in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sumo3dviz_pt.job.settings import CameraSettings, CinematicCamera, EulerianCamera


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
        lines = [f"{name:<{width}}  {_in_words(self[name])}" for name in self]
        return "\n".join(lines) or "no cameras"


def _in_words(camera: CameraSettings) -> str:
    """Return a camera in one line."""
    if isinstance(camera, EulerianCamera):
        aim = f"heading {camera.heading:g}°" if camera.heading is not None else ""
        aim = aim or f"looking at {_point(camera.look_at or ())}"
        return f"stands at {_point(camera.position)}, {aim}, {camera.lens.fov:g}° wide"
    if isinstance(camera, CinematicCamera):
        first, last = camera.keyframes[0], camera.keyframes[-1]
        ways = f"{_point(first.position)} to {_point(last.position)}"
        many = len(camera.keyframes)
        return f"flies from {ways}, {first.time:g} to {last.time:g} s, {many} key frames"
    return f"rides with {camera.vehicle}, view {camera.view}"


def _point(point: tuple[float, ...]) -> str:
    """Return a point in metres."""
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
