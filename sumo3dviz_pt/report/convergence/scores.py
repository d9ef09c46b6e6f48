"""Computes all error measures of one picture against a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.image import metrics
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.report.convergence.reference import Reference

CAP = 4.0
"""Cap of the capped RMSE, x white: brighter samples all look white."""

TRIM = 0.001
"""Share of the worst pixels that the trimmed relative MSE leaves out."""


@dataclass(frozen=True, slots=True)
class PictureLook:
    """How radiance becomes a picture.

    Attributes:
        exposure: Factor 2^exposure before the curve [EV].
        tone: Tone curve's name.
    """

    exposure: float
    tone: str

    @property
    def white(self) -> float:
        """Radiance that is shown as white, scene units."""
        return float(2.0**-self.exposure)

    def develop(self, radiance: Image) -> Image:
        """Return the display-encoded picture, (h, w, 3) in [0, 1]."""
        return develop_float(radiance, exposure=self.exposure, tone=self.tone)


def score(
    radiance: Image,
    reference: Reference,
    look: PictureLook,
    *,
    capped: Image | None = None,
    exposures: bool = True,
) -> dict[str, float]:
    """Return the errors of a picture by column of the report.

    Args:
        radiance: The picture, with haze, (h, w, 3).
        reference: The truth.
        look: Exposure and tone curve.
        capped: Mean of samples capped one by one at `CAP` x white, without haze; its
            error falls by 1/2 per log(spp). None, as for denoised pictures, cuts the
            pictures instead.
        exposures: Whether HDR-FLIP is worth its time, ten times that of all others.
    """
    truth, limit = reference.radiance, CAP * look.white
    shown, wanted = look.develop(radiance), look.develop(truth)
    errors = metrics.flip_map(shown, wanted)
    pair = (radiance, truth) if capped is None else (capped, reference.capped)
    # Radiance relative to white, so that errors of dim and bright scenes can be compared.
    relative, relative_truth = radiance / look.white, truth / look.white
    # Brighter than this is nothing but an emitter, or its image in glass and chrome.
    emitters = reference.sky | (relative_truth.max(axis=-1) > CAP)
    return {
        "rmse_capped": metrics.capped_rmse(*pair, cap=limit) / look.white,
        "relmse": metrics.relative_mse(relative, relative_truth),
        "relmse_trim": metrics.relative_mse(relative, relative_truth, trim=TRIM),
        "psnr": metrics.psnr(shown, wanted),
        "ssim": metrics.ssim(shown, wanted),
        "flip": float(errors.mean()),
        "flip_p99": float(np.percentile(errors, 99)),
        "hdrflip": metrics.hdr_flip(radiance, truth) if exposures else float("nan"),
        "mean_bias": metrics.mean_bias(radiance, truth, exempt=emitters),
    }
