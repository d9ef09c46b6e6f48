"""A film of two road users ahead of a camera, for tests of overlays."""

from __future__ import annotations

import numpy as np
from builders import view_at

from sumo3dviz_pt.job.overlays import OverlaySettings
from sumo3dviz_pt.overlays.facts import FilmFacts, FrameFacts

SIZE = (320, 180)
GREY = np.full((180, 320, 3), 0.25, dtype=np.float32)
KEYS = ("vehicle:own", "vehicle:near.1", "vehicle:far.2")


def film_of(overlays, *, frames=4, rate=10.0, inside=True):
    """A camera in `own` at 5 m/s behind `near.1`, 10 m ahead, and `far.2`, 40 m ahead."""
    found = []
    for number in range(frames):
        x = 5.0 * number / rate
        poses = np.array(
            [
                [x, 0.0, 0.0, 0.0, 0.0, 5.0],
                [x + 14.0, 0.0, 0.0, 0.0, 0.0, 10.0],
                [x + 44.0, 3.0, 0.0, 0.0, 0.0, np.nan],
            ]
        )
        around = np.array([[*pose[:2], pose[3], 4.0, 2.0, pose[5]] for pose in poses])
        view = view_at((x, 0.0, 1.5), heading=90.0, fov=60.0)
        found.append(FrameFacts(453.25 + number / rate, view, np.arange(3), poses, around))
    times = np.arange(450.0, 455.0, 0.1)
    path = np.column_stack(
        [times, 14.0 + 10.0 * (times - 453.25), np.zeros((len(times), 2)), times * 0 + 10.0]
    )
    return FilmFacts(
        OverlaySettings.model_validate(overlays),
        SIZE,
        rate,
        KEYS,
        np.tile([4.0, 2.0, 1.5], (3, 1)),
        "vehicle:own",
        found,
        {KEYS[1]: path},
        [np.array([[-50.0, 0.0], [100.0, 0.0]])],
        [3.2],
        inside=inside,
    )


def changed(one, other):
    """Rows and columns of pixels that differ, (n, 2)."""
    return np.argwhere(np.abs(one - other).max(axis=-1) > 1e-6)
