"""What rays may meet: one scene of Mitsuba's, or what moves and what stands apart.

Mitsuba builds the tree of a scene anew when anything in it has moved. Where what stands has a
scene of its own, its tree is built once, and rays ask both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.optix import check_scenes


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """All that rays may meet.

    Attributes:
        scene: Mitsuba's, of everything or of what moves.
        standing: Mitsuba's, of what stands; None where the other one holds that, too.
    """

    scene: Any
    standing: Any = None

    def __post_init__(self) -> None:
        """Refuse two scenes where a kernel may ask only one."""
        check_scenes(mi.variant(), 1 if self.standing is None else 2)

    def nearest(self, ray: Any, coherent: Any, active: Any = True) -> Any:
        """Return what a ray meets first, as Mitsuba's preliminary intersection.

        Args:
            ray: The ray.
            coherent: Whether neighbouring rays run alike.
            active: Which lanes count.
        """
        if self.standing is None:
            return self.scene.ray_intersect_preliminary(ray, coherent, active=active)
        stands = self.standing.ray_intersect_preliminary(ray, coherent, active=active)
        shorter = mi.Ray3f(ray)
        # The distance is inf where nothing stands. Where both are in one place, chance decided
        # in one scene; here it is what moves.
        shorter.maxt = dr.minimum(ray.maxt, stands.t)
        moves = self.scene.ray_intersect_preliminary(shorter, coherent, active=active)
        return dr.select(moves.is_valid(), moves, stands)

    def hide(self, ray: Any, active: Any) -> Any:
        """Return whether anything is in the way of a ray.

        Args:
            ray: It ends at its `maxt`.
            active: Which lanes count.
        """
        if self.standing is None:
            return self.scene.ray_test(ray, active)
        hidden = self.standing.ray_test(ray, active)
        return hidden | self.scene.ray_test(ray, active & ~hidden)
