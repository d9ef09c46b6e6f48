"""A rendered picture: what notebooks show of it is what is saved."""

from __future__ import annotations

import io
import json

import numpy as np
from PIL import Image

from sumo3dviz_pt.pipeline.stills.still import Still


def test_notebooks_show_the_developed_picture(tmp_path):
    radiance = np.random.default_rng(3).random((9, 16, 3)).astype(np.float32)
    still = Still(radiance, 0.0, "srgb", 0.0, True, {"seed": 3}, None)
    shown = still._repr_png_()
    with Image.open(io.BytesIO(shown)) as picture:
        picture.load()
        assert json.loads(picture.text["provenance"]) == {"seed": 3}
        np.testing.assert_array_equal(np.asarray(picture), still.develop())
    still.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as saved:
        np.testing.assert_array_equal(np.asarray(saved), still.develop())
