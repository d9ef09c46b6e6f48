"""What builders of vehicles give, and which builder a recipe names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.vehicles.recipe import Meshes, WheelPlace
from sumo3dviz_pt.model.scene import VehicleLamp


@dataclass(frozen=True, slots=True, eq=False)
class BakedVehicle:
    """The levels of a vehicle that travel with the package, in the body's frame.

    Attributes:
        parts: The near level, wheels included; fewer than 18,000 triangles.
        far: The far level, wheels included; fewer than 2,000 triangles.
        lamps: What can shine; the same at every level.
        wheels: Where the wheels are.
        cabin: x of the driver's back, height of the windows' edge and the measures of a
            `CabinSize` [m]; empty where panes show none.
    """

    parts: Meshes
    far: Meshes
    lamps: tuple[VehicleLamp, ...] = ()
    wheels: tuple[WheelPlace, ...] = ()
    cabin: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class FullVehicle:
    """The level for close views, built when first needed; fewer than 80,000 triangles.

    Attributes:
        body: Without wheels, in the body's frame.
        wheel: One wheel about its own centre, its outer face to +y; wheels on the right
            are this one, turned round.
    """

    body: Meshes
    wheel: Meshes


Recipe = Mapping[str, Any]
"""Content of an `asset.yaml`, completed by `recipes/<name>.yaml` under the key `recipe`."""


@dataclass(frozen=True, slots=True)
class Builder:
    """Functions that build a kind of vehicle.

    Attributes:
        bake: Makes the levels that travel with the package.
        full: Makes the level for close views, or None where there is none.
    """

    bake: Callable[[Recipe], BakedVehicle]
    full: Callable[[Recipe], FullVehicle] | None = None


def builder_of(recipe: Recipe, builders: Mapping[str, Builder]) -> Builder:
    """Return the builder that a recipe names under `build`.

    Raises:
        ConfigError: If there is none of that name.
    """
    name = recipe.get("build", "car")
    if name not in builders:
        raise ConfigError(f"no builder is called {name!r}; known: {', '.join(builders)}")
    return builders[name]


def with_sizes(asset: Mapping[str, Any]) -> dict[str, Any]:
    """Return the recipe of an `asset.yaml` with the vehicle's length, width and height."""
    sizes = {key: asset[key] for key in ("length", "width", "height") if key in asset}
    return {**asset.get("recipe", {}), **sizes}
