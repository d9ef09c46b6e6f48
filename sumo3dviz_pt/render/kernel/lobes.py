"""What a surface does with light: one function for all materials of the house.

It follows Mitsuba's `principled`, `principledthin` and `diffuse`, whose calls cost more than
their arithmetic: Dr.Jit compiles one function for each shape and material, and lanes wait for
each other at every call. Coats are our own: a sharp varnish that takes from what lies under it.
Here a material is a few numbers, and what no material of a scene has is not compiled.

References:
    Burley, "Physically Based Shading at Disney", SIGGRAPH course 2012. Walter et al.,
    "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007. Dupuy and Benyoub,
    "Sampling Visible GGX Normals with Spherical Caps", HPG 2023. Kelemen and Szirmay-Kalos,
    "A Microfacet Based Coupled Specular-Matte BRDF Model", Eurographics 2001.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

VARNISH = 1.5
"""Index of refraction of clear coats."""

_VARNISH_NORMAL = 0.04  # reflectance of such a coat from straight ahead
_VARNISH_MEAN = _VARNISH_NORMAL + (1.0 - _VARNISH_NORMAL) / 21.0  # of an even sky, by Schlick
_SHARPEST = 0.0005  # width of a coat's microfacets
CERTAIN = 1e18
"""Density of a mirror's direction, which no emitter's can match [1/sr]."""


@dataclass(frozen=True, slots=True)
class Lobes:
    """What some materials have that others have not; False is left out of the kernel.

    Attributes:
        coats: Clear coats; what lies under them may be metallic.
        leaves: Surfaces that light shines through.
        matts: Perfectly diffuse ones.
        two_sided: Ones that look the same from behind.
        metals: Metallic ones.
        mirrors: Perfect mirrors.
    """

    coats: bool = False
    leaves: bool = False
    matts: bool = False
    two_sided: bool = False
    metals: bool = False
    mirrors: bool = False


class Response(NamedTuple):
    """How much light a surface sends from one direction to another.

    Attributes:
        value: BSDF times the cosine, a colour.
        pdf: Chance that `bounce` picks this direction [1/sr].
    """

    value: Any
    pdf: Any


class Bounce(NamedTuple):
    """Where a path goes on.

    Attributes:
        wo: Unit, in the surface's frame.
        pdf: Its density [1/sr].
        weight: BSDF times the cosine over the density, a colour.
    """

    wo: Any
    pdf: Any
    weight: Any


@dataclass(frozen=True, slots=True, eq=False)
class Finish:
    """The material at a point, as arrays of Dr.Jit.

    Attributes:
        lobes: What the scene's materials have.
        colour: Reflectance.
        roughness: [0, 1].
        metallic: [0, 1].
        eta: Relative index of refraction of the reflection without colour, which is the coat's
            where there is one.
        coat: Share that is coated, [0, 1].
        coat_roughness: Of the coat; `roughness` is that of what lies under it.
        through: Share of the light that leaves a leaf on its other side, [0, 1].
        glossy: 1, or 0 for leaves and matt surfaces, which have no reflection.
        matt: Whether it is perfectly diffuse.
        open: Whether it is also seen from behind.
        mirror: Whether it is a perfect mirror, which has nothing but its colour.
    """

    lobes: Lobes
    colour: Any
    roughness: Any
    metallic: Any
    eta: Any
    coat: Any
    coat_roughness: Any
    through: Any
    glossy: Any
    matt: Any
    open: Any
    mirror: Any

    def side(self, wi: Any) -> Any:
        """Return -1 where an open surface is seen from behind, else 1."""
        if not (self.lobes.two_sided or self.lobes.leaves):
            return mi.Float(1.0)
        return dr.select(self.open & (wi.z < 0.0), mi.Float(-1.0), 1.0)

    def respond(self, wi: Any, wo: Any) -> Response:
        """Return what goes from `wo` to `wi`, unit vectors in the surface's frame."""
        side = self.side(wi)
        response = self._respond(side * wi, side * wo)
        if not self.lobes.mirrors:
            return response
        # No direction that something else picks is the mirror's own.
        return Response(*(dr.select(self.mirror, 0.0, each) for each in response))

    def bounce(self, wi: Any, pick: Any, sample: Any) -> Bounce:
        """Pick a direction for a path that came from `wi`.

        Args:
            wi: Unit, in the surface's frame.
            pick: Chooses the lobe, in [0, 1).
            sample: Chooses the direction, two numbers in [0, 1).
        """
        side = self.side(wi)
        wi = side * wi
        _, coat, diffuse = self._chances()
        diffuse_wo = mi.warp.square_to_cosine_hemisphere(sample)
        alpha = _width(self.roughness)
        if self.lobes.coats:
            alpha = dr.select(pick < diffuse + coat, _width(self.coat_roughness, _SHARPEST), alpha)
        wo = self._mirrored(wi, _facet(wi, sample, alpha))
        if self.lobes.leaves:
            leaving = pick >= diffuse * (1.0 - self.through)
            diffuse_wo = dr.select(leaving, mi.Vector3f(-diffuse_wo), mi.Vector3f(diffuse_wo))
        wo = dr.select(pick < diffuse, mi.Vector3f(diffuse_wo), wo)
        value, pdf = self._respond(wi, wo)
        weight = dr.select(pdf > 0.0, value * dr.rcp(pdf), 0.0)
        if not self.lobes.mirrors:
            return Bounce(side * wo, pdf, weight)
        back = mi.Vector3f(-wi.x, -wi.y, wi.z)
        shown = dr.select(wi.z > 0.0, self.colour, mi.Color3f(0.0))
        return Bounce(
            side * dr.select(self.mirror, back, wo),
            dr.select(self.mirror, CERTAIN, pdf),
            dr.select(self.mirror, shown, weight),
        )

    def _chances(self) -> tuple[Any, Any, Any]:
        """Return the chances of the glossy lobe, of the coat and of diffuse light."""
        diffuse = 1.0 - self.metallic if self.lobes.metals else mi.Float(1.0)
        glossy, coat = self.glossy, mi.Float(0.0)
        if self.lobes.coats:
            glossy, coat = glossy * dr.lerp(1.0, self.metallic, self.coat), self.coat
        total = dr.rcp(glossy + coat + diffuse)
        return glossy * total, coat * total, diffuse * total

    def _respond(self, wi: Any, wo: Any) -> Response:
        """Return what goes from one direction to another; `wi` lies on the front side."""
        in_cos, out_cos = wi.z, wo.z
        front = in_cos > 0.0
        reflected = front & (out_cos > 0.0)
        half = dr.normalize(wi + wo)
        along = dr.dot(wi, half)
        faced = reflected & (along > 0.0)
        glossy, coat, diffuse = self._chances()

        # The reflection that metals colour.
        density, shadow_in, shadow_out = _facets(wi, wo, half, _width(self.roughness))
        share = dr.rcp(4.0 * in_cos)
        plain = mi.fresnel(along, self.eta)[0]
        value = self._tint(plain, along) * (self.glossy * density * shadow_in * shadow_out * share)
        pdf = glossy * density * shadow_in * share
        base = self.colour
        if self.lobes.coats:
            under = self._under(in_cos, out_cos)
            value, base = value * under, base * under
            # Facets of so sharp a coat hide each other nowhere: one in a thousand at one degree.
            mirrored = _density(half, _width(self.coat_roughness, _SHARPEST)) * share
            value += self.coat * plain * mirrored
            pdf += coat * mirrored
        value = dr.select(faced, value, 0.0)
        pdf = dr.select(faced, pdf, 0.0)
        scattered = self._diffuse(wi, wo, half, base, diffuse)
        return Response(value + scattered.value, pdf + scattered.pdf)

    def _diffuse(self, wi: Any, wo: Any, half: Any, base: Any, diffuse: Any) -> Response:
        """Return the diffuse light, brighter back to where it came from on rough surfaces.

        Args:
            wi: On the front side.
            wo: Where it goes.
            half: Between both.
            base: Reflectance, as far as a coat lets it through.
            diffuse: Chance of diffuse light.
        """
        out_cos, front = wo.z, wi.z > 0.0
        reflected = front & (out_cos > 0.0)
        dull = 1.0 - self.metallic if self.lobes.metals else mi.Float(1.0)
        share = dull * dr.abs(out_cos) * dr.inv_pi
        lambert = diffuse * dr.abs(out_cos) * dr.inv_pi
        if not self.lobes.leaves:
            value = dr.select(reflected, base * (share * self._rough(wi, wo, half)), 0.0)
            return Response(value, dr.select(reflected, lambert, 0.0))
        passed = front & (out_cos < 0.0)
        back = (1.0 - self.through) * self._rough(wi, wo, half)
        value = dr.select(reflected | passed, base * share, 0.0)
        value *= dr.select(passed, self.through, back)
        split = dr.select(passed, self.through, 1.0 - self.through)
        return Response(value, dr.select(reflected | passed, lambert * split, 0.0))

    def _rough(self, wi: Any, wo: Any, half: Any) -> Any:
        """Return the factor of diffuse light that depends on the directions."""
        out, back = _schlick_weight(wo.z), _schlick_weight(wi.z)
        retro = 2.0 * self.roughness * dr.square(dr.dot(half, wo))
        factor = (1.0 - 0.5 * back) * (1.0 - 0.5 * out)
        factor += retro * (out + back + out * back * (retro - 1.0))
        return dr.select(self.matt, 1.0, factor) if self.lobes.matts else factor

    def _tint(self, plain: Any, cosine: Any) -> Any:
        """Return how much the glossy lobe reflects, a colour.

        Args:
            plain: What the outermost surface reflects without colour: the coat if there is one.
            cosine: Between the ray and the microfacet.
        """
        if self.lobes.coats:
            plain = plain * (1.0 - self.coat)
        if not self.lobes.metals:
            return mi.Color3f(plain)
        return dr.lerp(mi.Color3f(plain), _schlick(self.colour, cosine), self.metallic)

    def _under(self, in_cos: Any, out_cos: Any) -> Any:
        """Return the share of what lies under the coat that gets through it.

        What the coat takes on the way in and out is given back as by light between coat and base
        (Kelemen and Szirmay-Kalos 2001): a white base makes all of it white, and none brighter.
        """
        taken = _schlick(mi.Float(_VARNISH_NORMAL), in_cos)
        taken_out = _schlick(mi.Float(_VARNISH_NORMAL), dr.abs(out_cos))
        passed = (1.0 - taken) * (1.0 - taken_out) * (1.0 / (1.0 - _VARNISH_MEAN))
        return dr.lerp(1.0, passed, self.coat)

    def _mirrored(self, wi: Any, facet: Any) -> Any:
        """Return where a microfacet sends what comes from `wi`."""
        return 2.0 * dr.dot(wi, facet) * facet - wi


def _width(roughness: Any, least: float = 0.001) -> Any:
    """Return the width of the microfacets' distribution."""
    return dr.maximum(dr.square(roughness), least)


def _facets(wi: Any, wo: Any, half: Any, alpha: Any) -> tuple[Any, Any, Any]:
    """Return the facets' density, and the shares of them seen from `wi` and from `wo`."""
    return _density(half, alpha), _smith(wi, alpha), _smith(wo, alpha)


def _density(half: Any, alpha: Any) -> Any:
    """Return the density of microfacets."""
    alpha2 = dr.square(alpha)
    bulge = (dr.square(half.x) + dr.square(half.y)) / alpha2 + dr.square(half.z)
    density = dr.rcp(dr.pi * alpha2 * dr.square(bulge))
    return dr.select(density * half.z > 1e-20, density, 0.0)


def _facet(wi: Any, sample: Any, alpha: Any) -> Any:
    """Pick a microfacet that is seen from `wi`."""
    stretched = dr.normalize(mi.Vector3f(alpha * wi.x, alpha * wi.y, wi.z))
    sine, cosine = dr.sincos(dr.two_pi * sample.x)
    z = dr.fma(1.0 - sample.y, 1.0 + stretched.z, -stretched.z)
    radius = dr.safe_sqrt(1.0 - dr.square(z))
    cap = mi.Vector3f(radius * cosine, radius * sine, z) + stretched
    return dr.normalize(mi.Vector3f(alpha * cap.x, alpha * cap.y, cap.z))


def _smith(direction: Any, alpha: Any) -> Any:
    """Return the share of microfacets that are seen from a direction on the front side."""
    slope = dr.square(alpha) * (dr.square(direction.x) + dr.square(direction.y))
    return 2.0 * dr.rcp(1.0 + dr.sqrt(1.0 + slope / dr.square(direction.z)))


def _schlick(normal: Any, cosine: Any) -> Any:
    """Return Schlick's reflectance.

    Args:
        normal: Reflectance from straight ahead, a number or a colour.
        cosine: Between the ray and the microfacet.
    """
    weight = _schlick_weight(cosine)
    return normal * (1.0 - weight) + weight


def _schlick_weight(cosine: Any) -> Any:
    """Return the fifth power of 1 less a cosine."""
    rest = dr.clip(1.0 - cosine, 0.0, 1.0)
    return dr.square(dr.square(rest)) * rest
