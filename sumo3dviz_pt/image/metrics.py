"""How far an image is from a reference.

Plain RMSE of path-traced radiance does not converge: one sun glint can own it.
So radiance errors here are capped, or relative and trimmed; pictures are compared
by PSNR and FLIP.

References:
    Andersson et al., "FLIP: a difference evaluator for alternating images",
    HPG 2020, doi:10.1145/3406183.
    Rousselle et al., "Adaptive sampling and reconstruction using greedy error
    minimization", TOG 2011, doi:10.1145/2070781.2024193 (relative MSE).
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Image


def _same_shape(image: Image, reference: Image) -> None:
    """Refuse to broadcast."""
    if image.shape != reference.shape:
        raise ValueError(f"{image.shape} against a reference of {reference.shape}")


def capped_rmse(image: Image, reference: Image, *, cap: float) -> float:
    """Root mean square error of radiance, both images cut at `cap`.

    Its logarithm falls by 1/2 per log(spp); use about 4 x white as cap.

    Args:
        image: Radiance, (h, w, 3).
        reference: Radiance, (h, w, 3).
        cap: Brightest radiance that counts, > 0.
    """
    _same_shape(image, reference)
    difference = np.minimum(image, cap).astype(np.float64) - np.minimum(reference, cap)
    return float(np.sqrt(np.mean(difference**2)))


def relative_mse(
    image: Image, reference: Image, *, epsilon: float = 1e-2, trim: float = 0.0
) -> float:
    """Mean of squared error over squared reference.

    Args:
        image: Radiance, (h, w, 3).
        reference: Radiance, (h, w, 3).
        epsilon: Added to the squared reference, so that black can be divided by.
        trim: Share of the worst pixels to leave out, [0, 1); 0.001 drops fireflies.
    """
    _same_shape(image, reference)
    truth = reference.astype(np.float64)
    error = ((image - truth) ** 2 / (truth**2 + epsilon)).mean(axis=-1).ravel()
    kept = max(1, round(error.size * (1.0 - trim)))
    return float(np.partition(error, kept - 1)[:kept].mean())


def psnr(image: Image, reference: Image) -> float:
    """Peak signal-to-noise ratio of pictures in [0, 1] [dB]; infinite if equal."""
    _same_shape(image, reference)
    mse = float(np.mean((image.astype(np.float64) - reference) ** 2))
    return float("inf") if mse == 0 else float(-10.0 * np.log10(mse))


def mean_bias(image: Image, reference: Image) -> float:
    """Relative difference of the mean radiance; 0 is none."""
    _same_shape(image, reference)
    return float(image.mean(dtype=np.float64) / reference.mean(dtype=np.float64) - 1.0)


def flip_map(image: Image, reference: Image, *, pixels_per_degree: float = 67.0) -> Image:
    """FLIP error of each pixel, (h, w) in [0, 1]: the difference seen when flipping.

    Args:
        image: sRGB-encoded picture, (h, w, 3) in [0, 1].
        reference: Likewise.
        pixels_per_degree: Of visual angle; 67 is a 4K screen of 0.7 m at 0.7 m.

    Raises:
        ConfigError: If the package flip-evaluator (extra `test`) is missing.
    """
    _same_shape(image, reference)
    try:
        import flip_evaluator
    except ImportError as error:
        raise ConfigError("FLIP needs the package flip-evaluator: extra `test`") from error
    error_map, _, _ = flip_evaluator.evaluate(
        np.ascontiguousarray(reference, dtype=np.float32),
        np.ascontiguousarray(image, dtype=np.float32),
        "LDR",
        applyMagma=False,
        parameters={"ppd": pixels_per_degree},
    )
    return np.asarray(error_map, dtype=np.float32).reshape(image.shape[:2])


def flip(image: Image, reference: Image, *, pixels_per_degree: float = 67.0) -> float:
    """Mean FLIP error, [0, 1]; arguments and errors as in `flip_map`."""
    return float(flip_map(image, reference, pixels_per_degree=pixels_per_degree).mean())
