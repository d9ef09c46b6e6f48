"""Cloud layers as the three channels of an image, and back."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.scene import CloudLayer


def cloud_image(layer: CloudLayer) -> Image:
    """Pack cover, and light times cover, into (h, w, 3); nothing jumps where clouds end."""
    light = np.stack([layer.sunlit, layer.skylit], axis=-1) * layer.cover[..., None]
    return np.dstack([layer.cover, light]).astype(np.float32)


def cloud_layer(image: Image, *, lit_from: float) -> CloudLayer:
    """Unpack what `cloud_image` packed, from maps that may have lost a little in a file.

    Args:
        image: From `cloud_image`, (h, w, 3).
        lit_from: Elevation of the sun that the recipe had [rad].
    """
    cover = np.clip(image[..., 0], 0.0, 1.0)
    cover = np.where(cover > 0.992, 1.0, np.where(cover < 0.004, 0.0, cover))
    light = np.maximum(image[..., 1:], 0.0) / np.maximum(cover, 0.02)[..., None]
    sunlit, skylit = (np.ascontiguousarray(light[..., part], np.float32) for part in (0, 1))
    return CloudLayer(np.asarray(cover, np.float32), sunlit, skylit, lit_from)
