"""Measures of pictures: how far one is from a reference, and how much clutter it shows.

Plain RMSE of path-traced radiance does not converge, because one glint of the sun can make up most
of it. So radiance errors here are capped, or relative and trimmed; pictures are compared by PSNR,
SSIM and FLIP.

Clutter is edge density: the share of a picture's pixels that are edges. Edges are found as Canny
did: smooth, take the gradient, keep ridges of it, and follow them from strong edges to weaker ones.
The thresholds are fixed steps of encoded luma and not shares of a picture's strongest edge, so that
pictures can be compared.

References:
    Mack & Oliva, "Computational estimation of visual complexity", Object Perception, Attention and
    Memory 2004 (edge density); Rosenholtz, Li & Nakano, "Measuring visual clutter", Journal of
    Vision 7(2):17, 2007, doi:10.1167/7.2.17 (against other measures of clutter).
    Canny, "A computational approach to edge detection", IEEE TPAMI 8, 1986,
    doi:10.1109/TPAMI.1986.4767851.
    Andersson et al., "FLIP: a difference evaluator for alternating images",
    HPG 2020, doi:10.1145/3406183.
    Andersson et al., "Visualizing errors in rendered high dynamic range images",
    Eurographics Short Papers 2021, doi:10.2312/egs.20211015 (HDR-FLIP).
    Wang et al., "Image quality assessment: from error visibility to structural
    similarity", IEEE TIP 2004, doi:10.1109/TIP.2003.819861 (SSIM).
    Rousselle et al., "Adaptive sampling and reconstruction using greedy error
    minimization", TOG 2011, doi:10.1145/2070781.2024193 (relative MSE).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import gaussian_filter, label

from sumo3dviz_pt.errors import MissingExtraError
from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.layers import LUMINANCE

_SIGMA = 1.0
"""Of the smoothing [px]."""

_WEAK, _STRONG = 0.02, 0.05
"""Steps of luma per pixel from which an edge goes on, and from which it begins."""


def edge_density(luma: Floats) -> float:
    """Return the share of pixels that are edges, [0, 1].

    Args:
        luma: Encoded, (h, w) in [0, 1].
    """
    return float(edges(luma).mean())


def edges(luma: Floats) -> Bools:
    """Return which pixels are edges, (h, w).

    Args:
        luma: Encoded, (h, w) in [0, 1].
    """
    smooth = gaussian_filter(np.asarray(luma, dtype=np.float64), _SIGMA, mode="nearest")
    down, right = _slope(smooth, 0), _slope(smooth, 1)
    steep = np.hypot(down, right)
    ridges = steep * _is_ridge(steep, down, right)
    regions, count = label(ridges > _WEAK, structure=np.ones((3, 3)))
    begun = np.zeros(count + 1, dtype=np.bool_)
    begun[regions[ridges > _STRONG]] = True
    begun[0] = False
    return np.asarray(begun[regions])


def _slope(values: Floats, axis: int) -> Floats:
    """Return the gradient along an axis, (h, w); 0 where there is but one pixel."""
    if values.shape[axis] < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values, axis=axis), dtype=np.float64)


def _is_ridge(steep: Floats, down: Floats, right: Floats) -> Bools:
    """Return where the gradient is largest along its own direction, (h, w)."""
    wide = np.pad(steep, 1)
    eighth = np.round(np.arctan2(down, right) / (np.pi / 4)).astype(int) % 4
    ridge = np.zeros(steep.shape, dtype=np.bool_)
    height, width = steep.shape
    for turn, (rows, columns) in enumerate(((0, 1), (1, 1), (1, 0), (1, -1))):
        ahead = wide[1 + rows : 1 + rows + height, 1 + columns : 1 + columns + width]
        behind = wide[1 - rows : 1 - rows + height, 1 - columns : 1 - columns + width]
        ridge |= (eighth == turn) & (steep >= ahead) & (steep > behind)
    return ridge


_SSIM_RADIUS = 5
"""Radius of SSIM's 11 x 11 window [px]."""

_BRIGHTEST = 1e6
"""Limit of radiance for HDR-FLIP, whose tone curve squares it in single precision."""

_DARKEST = 1e-6
"""Luminance up to this counts as black for HDR-FLIP's exposures."""

_MOST_STOPS = 10.0
"""HDR-FLIP's darkest exposure lies at most this far below its brightest [EV]."""


def _same_shape(image: Image, reference: Image) -> None:
    """Refuse pictures of different shapes, which NumPy might broadcast."""
    if image.shape != reference.shape:
        raise ValueError(f"{image.shape} against a reference of {reference.shape}")


def capped_rmse(image: Image, reference: Image, *, cap: float) -> float:
    """Return the root mean square error of radiance, both images cut at `cap`.

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
    """Return the mean of squared error over squared reference.

    Args:
        image: Radiance, (h, w, 3).
        reference: Radiance, (h, w, 3).
        epsilon: Added to the squared reference, so that black can be divided by.
        trim: Share of the worst pixels to leave out, [0, 1); 0.001 drops fireflies.
    """
    _same_shape(image, reference)
    truth = reference.astype(np.float64)
    error = ((image - truth) ** 2 / (truth**2 + epsilon)).mean(axis=-1).ravel()
    count = max(1, round(error.size * (1.0 - trim)))
    return float(np.partition(error, count - 1)[:count].mean())


def psnr(image: Image, reference: Image) -> float:
    """Return the peak signal-to-noise ratio of pictures in [0, 1] [dB]; infinite if equal."""
    _same_shape(image, reference)
    mse = float(np.mean((image.astype(np.float64) - reference) ** 2))
    return float("inf") if mse == 0 else float(-10.0 * np.log10(mse))


def ssim(image: Image, reference: Image) -> float:
    """Return the structural similarity of pictures, [-1, 1]; 1 if their luma is equal.

    Wang et al. 2004, doi:10.1109/TIP.2003.819861: Gaussian window of 11 x 11 px and
    sigma 1.5, K1 = 0.01, K2 = 0.03, the mean over windows that lie wholly inside. A
    side of 10 px or less has no such window; there the picture is mirrored instead.

    Args:
        image: sRGB-encoded picture, (h, w, 3) in [0, 1].
        reference: sRGB-encoded picture, (h, w, 3) in [0, 1].
    """
    _same_shape(image, reference)
    x, y = (picture.astype(np.float64) @ LUMINANCE for picture in (image, reference))
    mean_x, mean_y = _windowed(x), _windowed(y)
    var_x, var_y = _windowed(x * x) - mean_x**2, _windowed(y * y) - mean_y**2
    covariance = _windowed(x * y) - mean_x * mean_y
    c1, c2 = 0.01**2, 0.03**2
    light = (2 * mean_x * mean_y + c1) / (mean_x**2 + mean_y**2 + c1)
    structure = (2 * covariance + c2) / (var_x + var_y + c2)
    cut = tuple(
        slice(_SSIM_RADIUS, -_SSIM_RADIUS) if side > 2 * _SSIM_RADIUS else slice(None)
        for side in x.shape
    )
    return float(np.clip((light * structure)[cut].mean(), -1.0, 1.0))


def _windowed(values: Floats) -> Floats:
    """Return the mean of each pixel's SSIM window, (h, w)."""
    return np.asarray(gaussian_filter(values, 1.5, radius=_SSIM_RADIUS), dtype=np.float64)


def mean_bias(image: Image, reference: Image, *, exempt: Bools | None = None) -> float:
    """Return the relative difference of the mean radiance; 0 is none, NaN if no pixel is left.

    Args:
        image: Radiance, (h, w, 3).
        reference: Radiance, (h, w, 3).
        exempt: Pixels to leave out, (h, w): those that see emitters directly, which
            hold most of the energy by night and none of the transport.
    """
    _same_shape(image, reference)
    mask = np.ones(image.shape[:2], dtype=bool) if exempt is None else ~exempt
    if not mask.any():
        return float("nan")
    mean, truth = (float(picture[mask].mean(dtype=np.float64)) for picture in (image, reference))
    if truth == 0.0:
        return 0.0 if mean == 0.0 else float("inf")
    return mean / truth - 1.0


def flip_map(image: Image, reference: Image, *, pixels_per_degree: float = 67.0) -> Image:
    """Return the FLIP error of each pixel, (h, w) in [0, 1]: the difference seen when flipping.

    Args:
        image: sRGB-encoded picture, (h, w, 3) in [0, 1].
        reference: sRGB-encoded picture, (h, w, 3) in [0, 1].
        pixels_per_degree: Of visual angle; 67 is a 4K screen of 0.7 m at 0.7 m.

    Raises:
        MissingExtraError: If the package flip-evaluator (extra `report`) is missing.
    """
    return _evaluated("LDR", image, reference, {"ppd": pixels_per_degree})


def flip(image: Image, reference: Image, *, pixels_per_degree: float = 67.0) -> float:
    """Return the mean FLIP error, [0, 1]; errors as in `flip_map`.

    Args:
        image: sRGB-encoded picture, (h, w, 3) in [0, 1].
        reference: sRGB-encoded picture, (h, w, 3) in [0, 1].
        pixels_per_degree: Of visual angle.
    """
    return float(flip_map(image, reference, pixels_per_degree=pixels_per_degree).mean())


def flip_p99(image: Image, reference: Image, *, pixels_per_degree: float = 67.0) -> float:
    """Return the FLIP error that 1 % of the pixels exceed, [0, 1]; errors as in `flip_map`.

    Args:
        image: sRGB-encoded picture, (h, w, 3) in [0, 1].
        reference: sRGB-encoded picture, (h, w, 3) in [0, 1].
        pixels_per_degree: Of visual angle.
    """
    errors = flip_map(image, reference, pixels_per_degree=pixels_per_degree)
    return float(np.percentile(errors, 99))


def hdr_flip(radiance: Image, reference: Image, *, pixels_per_degree: float = 67.0) -> float:
    """Return the mean HDR-FLIP error, [0, 1]: each pixel's worst FLIP over a range of exposures.

    The exposures are those of the paper: the brightest pixel of the reference down to
    0.85 of white, its median up to 0.85 of white (doi:10.2312/egs.20211015, ACES
    curve). Two things differ, because they must also work for night and sun. Black
    pixels do not count in the median. And the darkest exposure is at most 10 EV below
    the brightest: the sun's disc would ask for 20 exposures at which all else is
    black. Negative radiance counts as 0, radiance above 1e6 as 1e6.

    Args:
        radiance: Linear, (h, w, 3).
        reference: Linear, (h, w, 3); the exposures depend on it alone.
        pixels_per_degree: Of visual angle.

    Raises:
        ValueError: If a value is not finite.
        MissingExtraError: If the package flip-evaluator (extra `report`) is missing.
    """
    if not (np.isfinite(radiance).all() and np.isfinite(reference).all()):
        raise ValueError("HDR-FLIP compares finite radiance only")
    image, truth = (np.clip(picture, 0.0, _BRIGHTEST) for picture in (radiance, reference))
    low, high = _flip_exposures(truth)
    # Two at least: FLIP divides by their number less one.
    steps = {"numExposures": max(2, int(np.ceil(high - low)))}
    range_ev = {"startExposure": low, "stopExposure": high}
    settings = {"ppd": pixels_per_degree, **range_ev, **steps}
    return float(_evaluated("HDR", image, truth, settings).mean())


def _flip_exposures(reference: Image) -> tuple[float, float]:
    """Return the first and last exposure of HDR-FLIP [EV]; 0 and 0 for a black reference.

    flip-evaluator ends the whole process when it meets a median of 0, so its own
    choice cannot be used.
    """
    luminance = reference.astype(np.float64) @ LUMINANCE
    lit = luminance[luminance > _DARKEST]
    if lit.size == 0:
        return 0.0, 0.0
    # Narkowicz' ACES fit with FLIP's pre-exposure 0.6 is 0.85 here (flip.h).
    a, b, c, d, e = 0.6**2 * 2.51, 0.6 * 0.03, 0.6**2 * 2.43, 0.6 * 0.59, 0.14
    shown = float(np.max(np.roots([a - 0.85 * c, b - 0.85 * d, -0.85 * e])))
    high = float(np.log2(shown / np.median(lit)))
    return max(float(np.log2(shown / lit.max())), high - _MOST_STOPS), high


def _evaluated(
    kind: str, image: Image, reference: Image, settings: Mapping[str, float | int]
) -> Image:
    """Compute FLIP's error map, (h, w), in mode `LDR` or `HDR`."""
    _same_shape(image, reference)
    try:
        import flip_evaluator
    except ImportError as error:
        raise MissingExtraError("FLIP needs flip-evaluator", extra="report") from error
    error_map, _, _ = flip_evaluator.evaluate(
        np.ascontiguousarray(reference, dtype=np.float32),
        np.ascontiguousarray(image, dtype=np.float32),
        kind,
        applyMagma=False,
        parameters=dict(settings),
    )
    return np.asarray(error_map, dtype=np.float32).reshape(image.shape[:2])
