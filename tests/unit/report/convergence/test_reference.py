"""A reference's halves: means, their difference, storing and going on."""

from dataclasses import dataclass

import numpy as np
import pytest

from sumo3dviz_pt.report.convergence.plan import CHUNK, Halves, base_quality, chunk_quality

SHAPE = (6, 8)


@dataclass
class Chunk:
    """What a chunk of samples offers."""

    layers: dict


def chunk(rng, sigma=0.1):
    colour = (*SHAPE, 3)
    return Chunk(
        {
            "capped": (0.5 + sigma * rng.standard_normal(colour)).astype(np.float32),
            "lost": rng.random(colour, np.float32),
            "hit": rng.random(SHAPE, np.float32),
            "depth": rng.random(SHAPE, np.float32),
        }
    )


def grown(count, seed=1, sigma=0.1):
    rng, halves = np.random.default_rng(seed), Halves()
    chunks = [chunk(rng, sigma) for _ in range(count)]
    for part in chunks:
        halves.add(part)
    return halves, chunks


@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_means_are_those_of_the_chunks(count):
    halves, chunks = grown(count)
    assert halves.chunks == count and abs(halves.count[0] - halves.count[1]) <= 1
    if count > 1:
        np.testing.assert_allclose(
            halves.mean("capped"),
            np.mean([part.layers["capped"] for part in chunks], axis=0),
            rtol=1e-6,
        )
        np.testing.assert_allclose(
            halves.mean("hit", (1,)),
            np.mean([part.layers["hit"] for part in chunks[1::2]], axis=0),
            rtol=1e-6,
        )


def test_one_half_alone_says_nothing():
    assert grown(1)[0].difference() == np.inf
    assert np.isfinite(grown(2)[0].difference())


def test_difference_is_twice_the_error_of_the_mean():
    """Of white noise sigma, n chunks: halves differ by 2 sigma / sqrt(n)."""
    found = [grown(16, seed)[0] for seed in range(40)]
    differences = np.mean([halves.difference() for halves in found])
    errors = np.mean([np.sqrt(np.mean((h.mean("capped") - 0.5) ** 2)) for h in found])
    assert differences == pytest.approx(2 * 0.1 / 4, rel=0.03)
    assert differences == pytest.approx(2 * errors, rel=0.05)


def test_storing_and_going_on_is_the_same_as_not_stopping(tmp_path):
    whole, chunks = grown(7)
    halves, _ = grown(4)
    halves.save(tmp_path / "reference.npz")
    halves = Halves.load(tmp_path / "reference.npz")
    for part in chunks[4:]:
        halves.add(part)
    assert halves.count == whole.count
    np.testing.assert_array_equal(halves.mean("capped"), whole.mean("capped"))
    assert [path.name for path in tmp_path.iterdir()] == ["reference.npz"]


def test_chunks_are_independent_uncapped_beside_capped_and_undenoised():
    quality = chunk_quality(base_quality(4), depth=9, cap=4.0)
    assert (quality.sampler, quality.spp, quality.pass_spp) == ("independent", CHUNK, CHUNK)
    assert (quality.max_depth, quality.cap, quality.denoise) == (9, 4.0, "none")
