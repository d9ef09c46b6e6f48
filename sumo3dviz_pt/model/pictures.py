"""Words for what a picture is a picture of; they load nothing."""

from __future__ import annotations

from typing import Literal

Projection = Literal["perspective", "orthographic", "fisheye", "equirectangular"]
Stereo = Literal["none", "side_by_side", "top_bottom"]
