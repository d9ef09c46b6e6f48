"""Varnished paint for Mitsuba's own path tracer: our kernel's arithmetic as a plugin.

Mitsuba has no sharp coat over a metallic base that takes from it what it reflects. In JIT variants
a plugin in Python asks the kernel's own function. In scalar ones that would be slow: there paint
is `principled`, whose colourless reflection is as sharp as the coat, and effect paints do not flop.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.kernel.lobes import VARNISH, Finish, Lobes
from sumo3dviz_pt.render.paint import effect, flop_of_tint

_PLUGIN = "sumo3dviz_coated"


def register_coated() -> None:  # noqa: C901 - the plugin's class needs the variant to exist
    """Make the material known to the active JIT variant."""

    class CoatedBsdf(mi.BSDF):  # type: ignore[misc]
        """A paint under a varnish."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            # Plain colours and numbers become textures, too.
            self.base, self.flop = props.get_texture("base_color"), props.get_texture("flop")
            self.roughness = float(props["roughness"])
            self.under = float(props["under_roughness"])
            front = mi.BSDFFlags.FrontSide
            glossy = mi.BSDFFlags.GlossyReflection | front
            self.m_components = [mi.BSDFFlags.DiffuseReflection | front, glossy]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def _paint(self, si: Any, active: Any) -> Any:
            colour = mi.Color3f(self.base.eval_3(si, active))
            return effect(colour, 0.0, si.wi.z, self.flop.eval_1(si, active))

        def _finish(self, si: Any, active: Any) -> Finish:
            colour, metallic = self._paint(si, active)
            return Finish(
                Lobes(coats=True, metals=True),
                colour=colour,
                roughness=mi.Float(self.under),
                metallic=metallic,
                eta=mi.Float(VARNISH),
                coat=mi.Float(1.0),
                coat_roughness=mi.Float(self.roughness),
                through=mi.Float(0.0),
                glossy=mi.Float(1.0),
                matt=mi.Bool(False),
                open=mi.Bool(False),
                mirror=mi.Bool(False),
            )

        def sample(self, ctx: Any, si: Any, pick: Any, sample: Any, active: Any = True) -> Any:
            bounce = self._finish(si, active).bounce(si.wi, pick, sample)
            found = dr.zeros(mi.BSDFSample3f)
            found.wo, found.pdf, found.eta = bounce.wo, bounce.pdf, mi.Float(1.0)
            found.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
            found.sampled_component = mi.UInt32(1)
            valid = active & (bounce.pdf > 0.0)
            return found, dr.select(valid, bounce.weight, mi.Color3f(0.0))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value, pdf = self._finish(si, active).respond(si.wi, wo)
            return dr.select(active, value, mi.Color3f(0.0)), dr.select(active, pdf, 0.0)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            return self._paint(si, active)[0]

        def traverse(self, callback: Any) -> None:
            callback.put("base_color", self.base, mi.ParamFlags.Differentiable)
            callback.put("flop", self.flop, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "CoatedBsdf[]"

    mi.register_bsdf(_PLUGIN, lambda props: CoatedBsdf(props))


def coated_plugin(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return the material as a plugin dict.

    Args:
        value: Our own word for it, its colour as a plugin dict.
    """
    colour = dict(value["base_color"])
    if "scalar" in mi.variant():
        return {"type": "principled", "base_color": colour, "roughness": value["roughness"]}
    flop = flop_of_tint(colour) or float(value["flop"])
    return {**value, "type": _PLUGIN, "base_color": colour, "flop": flop}
