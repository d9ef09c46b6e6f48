"""How frames are averaged, said once more in NumPy, in double precision: what kernels must find."""

import numpy as np
from scipy.ndimage import minimum_filter, uniform_filter

from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.render.averaging.motion import motion_between

LAYERS = {"radiance": 3, "albedo": 3, "normal": 3, "hit": 1, "depth": 1}
MARGIN = 14


class Seen:
    """What is known of a traced frame; pictures are (h, w) or (h, w, channels)."""

    def __init__(self, frame):
        self.frame, self.size = frame, frame.layers.size
        self.layers = {name: frame.layers[name].astype(float) for name in LAYERS}
        first, hit, depth = (frame.layers[n].astype(float) for n in ("first_depth", "hit", "depth"))
        lens, camera = frame.view.lens, frame.view.world_from_camera.matrix[:3, :3]
        self.rays = lens.rays(self.size).astype(np.float32).astype(float)
        facing = np.abs(((self.rays @ camera.T) * self.layers["normal"]).sum(axis=-1))
        facing = np.clip(facing, 0.05, 1.0)
        slope = np.sqrt(1.0 - facing**2) / facing
        self.room = 0.02 + first * (0.01 + lens.pixel_angle(self.size[0]) * slope)
        one = (np.abs(depth - first * hit) < self.room) & (hit > 0.99)
        self.pure = np.where(first > 0.0, one, hit < 0.01)
        mean = depth / np.maximum(hit, 1e-6)
        self.distance = np.where(self.pure & (first > 0.0), mean, first)
        self.level = self.level_of(self.layers["radiance"])

    def level_of(self, radiance):
        """Return the logarithm of luminance."""
        return np.log(np.maximum(radiance @ LUMINANCE / self.frame.white, 0.0) + 0.02)


def all_around(mask):
    """Return where a mask holds in all of 3 x 3 pixels."""
    return minimum_filter(mask, 3, mode="nearest")


def rims_of(centre, others):
    """Return the pixels that what rides with a camera covers in part."""
    riding = [(other, motion) for other, motion in others if motion.riding.any()]
    if not riding:
        return np.zeros(centre.numbers.shape, bool)
    shown = np.logical_and.reduce([motion.riding for _, motion in riding])[centre.numbers]
    ever, always = shown, shown
    for other, motion in riding:
        shown = motion.in_second(motion.riding)[other.numbers]
        ever, always = ever | shown, always & shown
    return ever & ~always & ~all_around(ever) & ~all_around(~always)


def likeness(change, known):
    """Return how far light is the same, given the difference of its logarithms, (h, w)."""
    wide = np.pad(np.where(known, change, 0.0), MARGIN, mode="edge")
    there = np.pad(known.astype(float), MARGIN, mode="edge")

    def sums(values, window):
        return uniform_filter(values, window, mode="nearest") * window**2

    counts = {window: np.maximum(sums(there, window), 1.0) for window in (21, 9, 5, 3)}
    means = {window: sums(wide, window) / counts[window] for window in counts}
    spread = np.maximum(sums(wide**2, 21) / counts[21] - means[21] ** 2, 0.0)
    doubt = means[21] ** 2 / (spread / counts[21] + 1e-6)
    noise = 9 / 8 * sums(((wide - means[3]) * there) ** 2, 9) / counts[9]
    for window in (9, 5, 3):
        doubt = np.maximum(doubt, means[window] ** 2 / (noise / counts[window] + 1e-6))
    same = np.clip((5.0 - np.sqrt(np.maximum(doubt, 0.0))) / 3.0, 0.0, 1.0) * there
    return same[MARGIN:-MARGIN, MARGIN:-MARGIN]


def averaged(frame, neighbours):
    """Return a frame's averaged layers, and how many frames its pixels have."""
    centre = Seen(frame)
    others = [(other, motion_between(frame, other)) for other in neighbours]
    rims = rims_of(frame, others)
    total = {name: layer.copy() for name, layer in centre.layers.items()}
    frames = np.ones(centre.distance.shape)
    for other, motion in others:
        share, found = helped(centre, Seen(other), motion, rims)
        frames += share
        for name, layer in found.items():
            total[name] += (share if layer.ndim == 2 else share[..., None]) * layer
    layers = {
        name: layer / (frames if layer.ndim == 2 else frames[..., None])
        for name, layer in total.items()
    }
    return layers, frames


def helped(centre, other, motion, rims):
    """Return by how much another frame counts, and what it saw of each pixel."""
    here, there = centre.frame.numbers, other.frame.numbers
    same = all_around(motion.still[here] & motion.in_second(motion.still)[there])
    if motion.riding.any():
        same |= rims
    wanted = ~same & (centre.distance > 0.0) & motion.known[here]
    points = centre.rays * centre.distance[..., None]
    placed = motion.placements.astype(np.float32).astype(float)[here]
    moved = np.einsum("hwij,hwj->hwi", placed[..., :3, :3], points) + placed[..., :3, 3]
    (row, column), ahead = other.frame.view.lens.project(moved, centre.size)
    away = np.linalg.norm(moved, axis=-1)
    row, column = np.rint(row), np.rint(column)
    inside = ahead & (row >= 0) & (row < centre.size[1]) & (column >= 0)
    wanted &= inside & (column < centre.size[0])
    at = np.where(wanted, row, 0).astype(int), np.where(wanted, column, 0).astype(int)
    seen = {name: layer[at] for name, layer in other.layers.items()}
    both = other.pure[at] & centre.pure
    room = np.where(both, centre.room, 0.5 * away)
    fits = wanted & (there[at] == motion.there[here]) & (other.distance[at] > 0.0)
    fits &= np.abs(other.distance[at] - away) < room
    gaps = np.abs(seen["hit"] - centre.layers["hit"])
    fits &= gaps <= 0.25 + 0.5 / centre.frame.samples
    ratio = (centre.layers["albedo"] + 0.05) / (seen["albedo"] + 0.05)
    nearer = centre.distance / np.maximum(away, 1e-6)
    seen["radiance"] = seen["radiance"] * np.clip(ratio, 0.25, 4.0)
    seen["albedo"] = centre.layers["albedo"]
    seen["depth"] = seen["depth"] * nearer
    for name, layer in seen.items():
        own = same if layer.ndim == 2 else same[..., None]
        seen[name] = np.where(own, other.layers[name], layer)
    change = centre.level - centre.level_of(seen["radiance"])
    worth = np.where(same, 1.0, np.minimum(nearer, 1.0) ** 4)
    return likeness(change, same | fits) * worth, seen
