"""Traced frames of a small stage: a chequered ground, one box, a camera; no renderer needed."""

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traced import TracedFrame

SIZE = (96, 54)
LENS = Lens.of_degrees(60)


@dataclass(frozen=True)
class Stage:
    """A chequered ground and one box before a camera, lit evenly, under a dark sky.

    Attributes:
        eye: The camera's place relative to `origin` [m].
        yaw: Its direction [rad].
        box: Where the box's middle is relative to `origin` [m]; None is no box.
        turn: The box's yaw [rad].
        light: Of everything.
        shade: Light of the ground left of this y is halved [m]; None is nowhere.
        noise: Standard deviation of the radiance, as a share.
        name: Of the box.
        origin: Of everything in the network's coordinates [m].
    """

    eye: tuple[float, float, float] = (0.0, 0.0, 3.0)
    yaw: float = 0.0
    box: tuple[float, float, float] | None = (14.0, 0.0, 1.0)
    turn: float = 0.0
    light: float = 0.5
    shade: float | None = None
    noise: float = 0.0
    name: str = "vehicle:a/body"
    origin: tuple[float, float] = (0.0, 0.0)

    def frame(self, seed: int = 0) -> TracedFrame:
        """Trace the rays through the middles of the pixels."""
        here = np.array([*self.origin, 0.0])
        camera = Transform.from_pose(here + self.eye, yaw=self.yaw, pitch=-0.1)
        view = View(camera, LENS)
        rays = view.directions(SIZE)
        ground = np.where(rays[..., 2] < 0, -self.eye[2] / np.minimum(rays[..., 2], -1e-9), np.inf)
        spot = np.asarray(self.eye) + rays * np.where(np.isfinite(ground), ground, 0.0)[..., None]
        albedo = 0.3 + 0.3 * _chequer(spot[..., :2])
        bright = np.full(ground.shape, self.light)
        if self.shade is not None:
            bright = np.where(spot[..., 1] > self.shade, 0.5 * self.light, bright)
        normal = np.broadcast_to([0.0, 0.0, 1.0], rays.shape).copy()
        depth, ids, parts = ground, np.zeros(ground.shape), ()
        if self.box is not None:
            pose = Transform.from_pose(here + self.box, yaw=self.turn)
            parts = (MovingPart(self.name, pose),)
            local = Transform(np.linalg.inv(pose.matrix))
            start = local.points(camera.position[None])[0]
            met, side, place = _boxed(start, local.directions(rays), np.array([2.0, 1.0, 1.0]))
            nearer = met < ground
            depth, ids = np.where(nearer, met, ground), nearer.astype(float)
            albedo = np.where(nearer, 0.4 + 0.5 * _chequer(4 * place.sum(axis=-1)), albedo)
            bright = np.where(nearer, self.light, bright)
            normal = np.where(nearer[..., None], pose.directions(side), normal)
        hit = np.isfinite(depth)
        depth = np.where(hit, depth, 0.0)
        rng = np.random.default_rng(seed)
        clean = np.where(hit, albedo * bright, 0.1)
        factor = np.where(hit, 1 + self.noise * rng.standard_normal(hit.shape), 1.0)
        layers = {
            "radiance": np.repeat((clean * factor)[..., None], 3, axis=-1),
            "albedo": np.repeat(np.where(hit, albedo, 0.0)[..., None], 3, axis=-1),
            "normal": np.where(hit[..., None], normal, 0.0),
            "hit": hit,
            "depth": depth,
            "first_depth": depth,
            "ids": ids,
        }
        arrays = {name: np.asarray(layer, np.float32) for name, layer in layers.items()}
        return TracedFrame(Layers(arrays), view, parts=parts)


def _chequer(place):
    """Return a smooth pattern of waves, (...) in [-0.5, 0.5]."""
    wave = np.sin(place)
    return 0.5 * (wave if wave.ndim == 2 else wave.prod(axis=-1))


def _boxed(start, rays, half):
    """Return distance, outward normal and point where rays meet a box about the origin."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-half - start) / rays, (half - start) / rays
    entry, leave = np.minimum(a, b), np.maximum(a, b)
    axis = entry.argmax(axis=-1)
    first = entry.max(axis=-1)
    met = (first < leave.min(axis=-1)) & (first > 0)
    distance = np.where(met, first, np.inf)
    side = -np.sign(rays) * np.eye(3)[axis]
    place = start + rays * np.where(met, first, 0.0)[..., None]
    return distance, side, place
