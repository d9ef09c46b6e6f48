"""White furnace: in a closed sky of radiance 1 nothing may look brighter than the sky.

`test_energy.py` puts every material on a ball that does not move. Here are the other
ways by which a user gets one: image surfaces, paint by instance, bodies near and far,
meshes of their own; and the whole range of `principled` that the house rules allow.

References:
    Heitz 2014, Understanding the masking-shadowing function, JCGT 3(2) (the furnace test).
"""

import numpy as np
import pytest
from builders import RAW, ball, frame_of, mover, scene_of, session_of, static, view_at
from significance import sidak_z, standard_error

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.materials import MATERIALS, matt, principled, surface_bsdf, two_sided
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype, Slots
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.coated import register_coated
from sumo3dviz_pt.render.compound import is_plain
from sumo3dviz_pt.render.convert import plugin
from sumo3dviz_pt.render.rooms import register_rooms
from sumo3dviz_pt.render.textures import register_untiled

pytestmark = pytest.mark.slow

GAIN = 1.02
"""Most that `principled` may add at a base colour of 0.85."""

WHITE = (0.85, 0.85, 0.85)
SURFACES = catalog.names("surfaces")
TINTED = ("paint", "cloth", "wall", "roof", "sign")
BODIES = (*TINTED, "leaf", "chrome", "rim", "glass")


PLAIN = {
    "white": principled(WHITE, roughness=0.35),
    "silver": principled((0.8, 0.7, 0.6), roughness=0.2, metallic=1.0),
    "earth": principled((0.3, 0.2, 0.1), roughness=0.9, metallic=0.3),
}
"""Materials without textures, which become one that reads its values from the faces."""

NAMES = [
    *(f"surface:{name}" for name in SURFACES),
    "user's image",
    "user's mesh",
    *(f"merged {kind}" for kind in PLAIN),
    *(f"apart {kind}" for kind in PLAIN),
    *(f"{kind} {name}" for kind in ("near", "far") for name in BODIES),
]

# Everything that is drawn ------------------------------------------------------------------

SPACING, RADIUS, PER_ROW = 6.0, 1.0, 8


def spot(index):
    """Centre of a ball [m]; all face a camera high above."""
    return np.array([SPACING * (index % PER_ROW), SPACING * (index // PER_ROW), 0.0])


def ball_with_uvs(centre):
    """A ball that shows about one tile of a surface."""
    plain = ball(centre, RADIUS)
    return Mesh(plain.vertices, plain.faces, plain.normals, 0.5 * (plain.vertices - centre)[:, :2])


@pytest.fixture(scope="module")
def image_file(tmp_path_factory):
    """A user's image, as white as eight bits can be."""
    from sumo3dviz_pt.image.png import write_png

    path = tmp_path_factory.mktemp("image") / "white.png"
    write_png(path, np.full((4, 4, 3), 255, dtype=np.uint8))
    return path


@pytest.fixture(scope="module")
def furnace(image_file):
    """Radiance of each ball by name."""
    materials = {
        **MATERIALS,
        **{f"surface:{name}": surface_bsdf(catalog.find("surfaces", name)) for name in SURFACES},
        "user's image": matt({"type": "bitmap", "filename": str(image_file)}),
        "user's mesh": two_sided(principled(WHITE, roughness=0.35)),
        **{f"merged {name}": bsdf for name, bsdf in PLAIN.items()},
        **{f"apart {name}": two_sided(bsdf) for name, bsdf in PLAIN.items()},
    }
    bodies = {
        name: Prototype(
            name, (Part(ball((0, 0, 0), RADIUS), name),), (Part(ball((0, 0, 0), RADIUS), name),)
        )
        for name in BODIES
    }
    places = {name: spot(k) for k, name in enumerate(NAMES)}
    parts = [static(n, ball_with_uvs(places[n]), n) for n in NAMES if n in materials]
    slots = dict.fromkeys(bodies, 1)
    scene = scene_of(
        parts, materials, prototypes=bodies.values(), slots=Slots(near=slots, far=slots)
    )
    movers, far = (
        [mover(n, places[f"{kind} {n}"], WHITE, prototype=n) for n in bodies]
        for kind in ("near", "far")
    )
    view = view_at((*np.mean(list(places.values()), axis=0)[:2], 80.0), pitch=-90, fov=35)
    quality = RAW.model_copy(update={"spp": 64, "pass_spp": 64, "max_depth": 16})
    size = (200, 160)
    with session_of(scene, size=size, quality=quality) as session:
        image = session.render(frame_of(view, movers=movers, far=far)).radiance
    half = view.lens.half_width
    rows, columns = np.mgrid[: size[1], : size[0]]
    x = (1 - 2 * (columns + 0.5) / size[0]) * half
    y = (1 - 2 * (rows + 0.5) / size[1]) * half * size[1] / size[0]
    found = {}
    for name, place in places.items():
        ahead, left, up = (place - view.position) @ view.world_from_camera.matrix[:3, :3]
        inside = np.hypot(x - left / ahead, y - up / ahead) < 0.9 * RADIUS / ahead
        assert inside.sum() > 20
        found[name] = image[inside].astype(np.float64)
    return found, image


@pytest.mark.parametrize("name", NAMES)
def test_nothing_that_is_drawn_makes_light(furnace, name):
    pixels = furnace[0][name]
    mean, error = pixels.mean(axis=0), pixels.std(axis=0) / np.sqrt(len(pixels))
    assert (mean <= GAIN + sidak_z(3 * len(NAMES), sides=1) * error).all()
    assert pixels.min() >= 0


@pytest.mark.parametrize("name", [n for n in NAMES if n.endswith(TINTED)])
def test_paint_is_as_bright_as_its_colour(furnace, name):
    """A coat adds some, rough paint loses some; another instance's colour would show."""
    assert furnace[0][name].mean() == pytest.approx(0.85, abs=0.05)


def test_a_ball_of_leaves_glows_by_what_shines_through_them(furnace):
    """Half of 0.85 comes back at once (r); as much goes in (t) and leaves after bounces."""
    r = t = 0.425
    assert furnace[0]["near leaf"].mean() == pytest.approx(r + t * t / (1 - r), abs=0.05)


@pytest.mark.parametrize("name", PLAIN)
def test_merged_materials_look_as_they_do_apart(furnace, name):
    """A two-sided material is not merged, so it keeps its own colour, roughness, metal."""
    assert is_plain(PLAIN[name]) and not is_plain(two_sided(PLAIN[name]))
    merged, apart = furnace[0][f"merged {name}"], furnace[0][f"apart {name}"]
    error = np.hypot(standard_error(merged, axis=0), standard_error(apart, axis=0))
    difference = np.abs(merged.mean(axis=0) - apart.mean(axis=0))
    assert (difference <= sidak_z(9) * error + 0.005).all()


def test_a_white_image_gives_back_all_light(furnace):
    """Users' images are matt, so eight bits cannot say more than 1.

    The balls around it are darker and take some of what it sends them.
    """
    assert 0.95 < furnace[0]["user's image"].mean() <= 1.0 + 1e-4
    np.testing.assert_allclose(furnace[1][0, 0], 1.0, rtol=1e-5)


# The range of `principled` ------------------------------------------------------------------

ROUGHNESS = (0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
METALLIC = (0.0, 0.5, 1.0)
SPECULAR = (0.05, 0.25, 0.5, 0.7, 1.0)
COATS = (None, 0.5, 0.95)
COSINES = np.append((np.arange(20) + 0.5) / 20, 1.0)
"""Between ray and normal: middles of equal steps, for integrals, and straight down."""

SAMPLES = 5000


def grid_texture(values):
    """A texture with one texel per pair of roughness (down) and metallic (across)."""
    import mitsuba as mi

    texels = np.broadcast_to(values, (len(ROUGHNESS), len(METALLIC))).astype(np.float32)
    return mi.load_dict(
        {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(texels[..., None])),
            "raw": True,
            "filter_type": "nearest",
        }
    )


def albedos(specular, coat):
    """Share of light given back by roughness x metallic x cosine, and its standard error."""
    import drjit as dr
    import mitsuba as mi

    more = {} if coat is None else {"clearcoat": 1.0, "clearcoat_gloss": coat}
    bsdf = mi.load_dict(
        {
            "type": "principled",
            "base_color": {"type": "rgb", "value": list(WHITE)},
            "roughness": grid_texture(np.array(ROUGHNESS)[:, None]),
            "metallic": grid_texture(np.array(METALLIC)[None]),
            "specular": specular,
            **more,
        }
    )
    shape = (len(ROUGHNESS), len(METALLIC), len(COSINES))
    row, column, angle = (axis.ravel() for axis in np.indices(shape))
    each = [
        np.repeat(values.astype(np.float32), SAMPLES)
        for values in (
            (column + 0.5) / len(METALLIC),
            (row + 0.5) / len(ROUGHNESS),
            COSINES[angle],
        )
    ]
    u, v, cosine = (mi.Float(values) for values in each)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(5, dr.width(u))
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(u))
    si.uv = mi.Point2f(u, v)
    si.wi = mi.Vector3f(dr.sqrt(1 - cosine * cosine), 0, cosine)
    _, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
    weights = np.array(weight)[0].astype(np.float64).reshape(*shape, SAMPLES)
    return weights.mean(axis=-1), weights.std(axis=-1) / np.sqrt(SAMPLES)


@pytest.fixture(scope="module", params=[(s, c) for s in SPECULAR for c in COATS], ids=str)
def sweep(request):
    """Albedos, errors and the z-limit of the whole family."""
    choose_backend("llvm")
    mean, error = albedos(*request.param)
    return mean, error, sidak_z(mean.size * len(SPECULAR) * len(COATS), sides=1)


def test_principled_makes_no_light_of_a_whole_sky(sweep):
    """Under an even sky, that is with light from all sides."""
    mean, error, limit = sweep
    weight = 2.0 * COSINES[:-1] / len(COSINES[:-1])
    whole = (mean[..., :-1] * weight).sum(axis=-1)
    spread = np.sqrt(((error[..., :-1] * weight) ** 2).sum(axis=-1))
    assert (whole <= 1.0 + limit * spread).all()
    assert whole[:, 0].min() > 0.7, "white that swallows a third of the light is suspicious"


def test_principled_makes_no_light_seen_from_above(sweep):
    """At least 24 degrees over the surface; metals from everywhere."""
    mean, error, limit = sweep
    gain = mean - limit * error
    assert gain[..., COSINES > 0.4].max() <= GAIN
    assert gain[:, METALLIC.index(1.0)].max() <= GAIN


def test_principled_gains_at_grazing_angles_what_is_known(sweep):
    """Its diffuse part does not give way to its specular one; more would be news."""
    mean, error, limit = sweep
    assert (mean - limit * error).max() <= 1.4


# Materials as they are ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def own_albedos():
    """Directional albedo of every material and surface in its own colours, by name."""
    choose_backend("llvm")
    register_untiled()
    register_rooms()
    register_coated()
    found = {}
    for name, bsdf in MATERIALS.items():
        found[name] = seen_along(plugin(bsdf, tint={"type": "rgb", "value": [0.8] * 3}))
    for name in SURFACES:
        own = surface_bsdf(catalog.find("surfaces", name))
        found[f"surface:{name}"] = seen_along(plugin(own, tint={}))
    return found


def seen_along(bsdf):
    """Albedo by cosine and channel, over the whole texture, and its standard error."""
    import drjit as dr
    import mitsuba as mi

    each = 20_000
    cosine = mi.Float(np.repeat(COSINES.astype(np.float32), each))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(9, dr.width(cosine))
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(cosine))
    si.uv = sampler.next_2d()
    si.wi = mi.Vector3f(dr.sqrt(1 - cosine * cosine), 0, cosine)
    plain = mi.load_dict(bsdf)
    _, weight = plain.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
    weights = np.array(weight).astype(np.float64).reshape(3, len(COSINES), each)
    return weights.mean(axis=-1), weights.std(axis=-1) / np.sqrt(each)


@pytest.mark.parametrize("name", [*MATERIALS, *(f"surface:{n}" for n in SURFACES)])
def test_what_we_ship_makes_no_light_in_its_own_colours(own_albedos, name):
    """Surfaces from everywhere; lower than 12 degrees white paints gain (see above)."""
    mean, error = own_albedos[name]
    limit = sidak_z(mean.size * len(own_albedos), sides=1)
    lowest = 0.0 if name.startswith(("surface:", "line_")) else 0.2
    assert (mean - limit * error)[:, lowest < COSINES].max() <= GAIN
    weight = 2.0 * COSINES[:-1] / len(COSINES[:-1])
    assert (mean[:, :-1] * weight).sum(axis=-1).max() <= 0.95
