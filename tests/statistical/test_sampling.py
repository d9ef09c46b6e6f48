"""Directions are drawn as their densities say: chi-squared tests of skies and materials.

What is tested is Mitsuba's sampling of the maps and materials that we give it. The kernel of
our own calls Mitsuba for maps, and is held against Mitsuba in `test_kernel.py`.
"""

import numpy as np
import pytest
from builders import RAW, ball, frame_of, plane, scene_of, session_of, static, view_at
from significance import sidak_z

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.library.materials import MATERIALS, surface_bsdf
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.coated import register_coated
from sumo3dviz_pt.render.convert import constant_tint, plugin
from sumo3dviz_pt.render.sky.baked import bake_sky
from sumo3dviz_pt.render.sky.daylight import directions
from sumo3dviz_pt.render.sky.weathered import sky_entry
from sumo3dviz_pt.render.textures import register_untiled
from sumo3dviz_pt.world.sky import build_sky

pytestmark = pytest.mark.slow

LEVEL = 1e-3
"""Chance that this file fails though all is well."""

COSINES = (1.0, 0.6, 0.2)
"""Between ray and normal."""

PLAIN = ("paint", "glass", "chrome", "leaf", "cloth", "steel")
TEXTURED = ("asphalt", "plaster")
TESTS = len(COSINES) * (len(PLAIN) + len(TEXTURED)) + 3


@pytest.fixture(autouse=True, scope="module")
def variant():
    choose_backend("llvm")
    register_untiled()
    register_coated()


def passes(sample, density, *, dimensions, domain=None, **more):
    """Whether samples follow their density, and what the test says."""
    from mitsuba.chi2 import ChiSquareTest, SphericalDomain

    test = ChiSquareTest(
        domain=domain or SphericalDomain(),
        sample_func=sample,
        pdf_func=density,
        sample_dim=dimensions,
        **more,
    )
    return test.run(LEVEL, test_count=TESTS, quiet=True), test.messages


# Skies --------------------------------------------------------------------------------------


def low_sun():
    """A clear sky with the sun 4 degrees up: bright in one place."""
    return build_sky(SkySettings(sun={"azimuth": 250, "elevation": 4}))


def cloudy():
    return build_sky(SkySettings(preset="sky_daycloud2"))


def one_spot():
    """Dark but for a spot in the east, half up."""
    image = np.full((64, 128, 3), 0.01, dtype=np.float32)
    image[14:18, 30:34] = 30.0
    return Sky(None, image=image)


SKIES = {"low sun": low_sun, "clouds": cloudy, "spot": one_spot}


@pytest.mark.parametrize("name", SKIES)
def test_skies_are_sampled_as_their_density_says(name):
    """A coarser map than the film's, so that the density's integral per cell is exact enough."""
    import drjit as dr
    import mitsuba as mi

    emitter = placed(sky_entry(bake_sky(SKIES[name](), (128, 256))))

    def sample(numbers):
        interaction = dr.zeros(mi.Interaction3f, dr.width(numbers))
        return emitter.sample_direction(interaction, mi.Point2f(numbers))[0].d

    def density(towards):
        found = dr.zeros(mi.DirectionSample3f, dr.width(towards))
        found.d = towards
        return emitter.pdf_direction(dr.zeros(mi.Interaction3f, dr.width(towards)), found)

    good, messages = passes(sample, density, dimensions=2, sample_count=200_000, ires=16, res=61)
    assert good, messages


def placed(emitter):
    """An emitter that knows a scene's size, as it needs to be sampled."""
    import mitsuba as mi

    scene = mi.load_dict({"type": "scene", "sky": emitter, "ball": {"type": "sphere"}})
    return scene.environment()


@pytest.mark.parametrize("name", SKIES)
def test_samples_weigh_what_the_map_holds(name):
    """Mean weight is the map's integral, and directions are the world's: z-test per channel."""
    import drjit as dr
    import mitsuba as mi

    count, size, limit = 400_000, (128, 256), sidak_z(27)
    baked = bake_sky(SKIES[name](), size)
    emitter = placed(sky_entry(baked))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(3, count)
    found, weight = emitter.sample_direction(dr.zeros(mi.Interaction3f, count), sampler.next_2d())
    weights = np.array(weight, dtype=np.float64)
    drawn = np.array(found.d, dtype=np.float64)
    towards = directions(size)
    solid = np.sin(np.arccos(towards[..., 2])) * (np.pi / size[0]) * (2 * np.pi / size[1])
    for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1]):
        # The share of light from the half space around each world axis.
        values = weights * np.maximum(np.array(axis) @ drawn, 0.0)
        known = (baked.radiance * (solid * np.maximum(towards @ axis, 0.0))[..., None]).sum((0, 1))
        error = values.std(axis=1) / np.sqrt(count)
        assert (np.abs(values.mean(axis=1) - known) <= 0.01 * known + limit * error).all()


# Materials ----------------------------------------------------------------------------------


class Lobe:
    """Directions by their turn around an axis and the fourth root of their angle to it.

    Smooth materials scatter into a fraction of a degree, far less than a cell of a whole
    sphere's histogram, over which no quadrature gets the density right.
    """

    def __init__(self, axis):
        import mitsuba as mi

        self.frame = mi.Frame3f(mi.Vector3f(*axis))

    def bounds(self):
        import drjit as dr
        import mitsuba as mi

        return mi.ScalarBoundingBox2f([-dr.pi, 0.0], [dr.pi, 1.0])

    def aspect(self):
        return 0.5

    def map_forward(self, p):
        import drjit as dr
        import mitsuba as mi

        angle = dr.pi * p.y**4
        around, across = dr.sincos(p.x), dr.sincos(angle)
        local = mi.Vector3f(around[1] * across[0], around[0] * across[0], across[1])
        return self.frame.to_world(local)

    def map_backward(self, towards):
        import drjit as dr
        import mitsuba as mi

        angle, local = self.angle(towards)
        return mi.Vector2f(dr.atan2(local.y, local.x), dr.sqrt(dr.sqrt(angle / dr.pi)))

    def angle(self, towards):
        """To the axis, exact where it is small; and the direction around it."""
        import drjit as dr

        local = self.frame.to_local(towards)
        return dr.atan2(dr.sqrt(local.x**2 + local.y**2), local.z), local

    def stretch(self, towards):
        """Solid angle per area of the domain."""
        import drjit as dr

        angle, _ = self.angle(towards)
        root = dr.sqrt(dr.sqrt(angle / dr.pi))
        return dr.sin(angle) * 4.0 * dr.pi * root**3


def shipped(name):
    """A material as Mitsuba takes it."""
    if name in TEXTURED:
        return plugin(surface_bsdf(catalog.find("surfaces", name)), tint={})
    return plugin(MATERIALS[name], tint=constant_tint((0.6, 0.3, 0.1)))


@pytest.mark.parametrize("cosine", COSINES)
@pytest.mark.parametrize("name", [*PLAIN, *TEXTURED])
def test_materials_are_sampled_as_their_density_says(name, cosine):
    from mitsuba.chi2 import BSDFAdapter

    bsdf, sine = shipped(name), float(np.sqrt(1.0 - cosine**2))
    domain = Lobe((-sine, 0.0, cosine))
    sample, of_solid_angle = BSDFAdapter(bsdf["type"], bsdf, wi=[sine, 0.0, cosine])

    def density(towards):
        return of_solid_angle(towards) * domain.stretch(towards)

    good, messages = passes(
        sample, density, dimensions=3, domain=domain, sample_count=200_000, ires=16, res=80
    )
    assert good, messages


# The firefly cap ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def street():
    """A glossy scene with a small bright light: what a firefly cap is for."""
    image = np.full((32, 64, 3), 0.2, dtype=np.float32)
    image[8:10, 20:22] = 400.0
    parts = [
        static("g", plane(40), "asphalt"),
        static("b", ball((0, 6, 1), 1.0), "chrome"),
        static("c", ball((2.2, 6, 1), 1.0), "rim"),
    ]
    materials = {name: MATERIALS[name] for name in ("chrome", "rim")}
    materials["asphalt"] = surface_bsdf(catalog.find("surfaces", "asphalt"))
    return scene_of(parts, materials, sky=Sky(None, image=image))


def traced(street, cap, *, white=1.0, spp=16):
    """Samples of one frame."""
    quality = RAW.model_copy(update={"spp": spp, "pass_spp": min(spp, 8), "cap": cap})
    view = view_at([1, 0, 1.5], pitch=-4)
    with session_of(street, size=(48, 27), quality=quality, white=white, seed=4) as session:
        return session.samples(frame_of(view))


def test_an_endless_cap_is_plain_path_tracing(street):
    plain, endless = traced(street, None), traced(street, 1e30)
    np.testing.assert_allclose(endless.layers["capped"], plain.layers["capped"], rtol=1e-6)
    assert endless.layers["lost"].max() == 0 and endless.tally.capped == 0


@pytest.mark.parametrize(("cap", "white"), [(40.0, 1.0), (4.0, 0.25), (0.5, 1.0)])
def test_what_stays_and_what_is_lost_is_plain_path_tracing(street, cap, white):
    plain, cut = traced(street, None).layers, traced(street, cap, white=white)
    kept, lost, shown = (cut.layers[name] for name in ("capped", "lost", "radiance"))
    assert (lost >= 0).all() and (lost > 0).any()
    np.testing.assert_allclose(kept + lost, plain["capped"], rtol=2e-5, atol=1e-6)
    assert kept.max() <= cap * white * (1 + 1e-5)
    # Where the sky is seen, the cap does not count.
    sky = cut.layers["hit"] < 1.0
    np.testing.assert_allclose(shown[sky], plain["radiance"][sky], rtol=2e-5, atol=1e-6)
    np.testing.assert_array_equal(shown[~sky], kept[~sky])
    share = lost[~sky].sum() / plain["capped"].sum()
    assert cut.tally.capped_share == pytest.approx(share, rel=1e-3)


def test_the_cap_keeps_hues(street):
    """With one sample per pixel all channels shrink alike, and none stays over the limit."""
    plain, cut = (traced(street, cap, spp=1).layers["capped"] for cap in (None, 0.5))
    over = plain.max(axis=-1) > 0.5
    assert over.sum() > 20
    np.testing.assert_allclose(cut[over].max(axis=-1), 0.5, rtol=1e-5)
    shrunk = cut[over] / plain[over]
    assert np.ptp(shrunk, axis=-1).max() < 1e-5
    np.testing.assert_array_equal(cut[~over], plain[~over])
