"""Whatever can be chosen by name is complete; a new entry is tested when it appears."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CameraSettings, Job, LagrangianCamera, SkySettings
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.vehicles.packed import BODIES, FULL
from sumo3dviz_pt.pipeline.production import object_files, scenario_files
from sumo3dviz_pt.pipeline.scene_file import load_job, make_job, quality_preset

BRIGHTEST = 0.85  # principled conserves energy up to this base colour
FAMILIES = sorted(path.name for path in catalog.data_root("assets").iterdir() if path.is_dir())
FILELESS = ("people", "plants", "buildings", "palettes", "materials", "road_styles", "shop_words")
VEHICLES = catalog.names("vehicles")
COUPLED = [name for name in VEHICLES if "units" in catalog.find("vehicles", name).meta]
SINGLE = [name for name in VEHICLES if name not in COUPLED]
KINDS = sorted(path.name for path in catalog.data_root("scene_templates").iterdir())
ASSETS = [(family, name) for family in FAMILIES for name in catalog.names(family)]
EXAMPLES = sorted(path.parent for path in catalog.data_root("examples").glob("*/scene.yaml"))


def presets(kind: str) -> list[str]:
    return list(catalog.template_names(kind))


def files_named_in(value: Any) -> Iterator[str]:
    """Every map or bitmap that an `asset.yaml` names."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key in ("filename", "map") and isinstance(inner, str):
                yield inner
            else:
                yield from files_named_in(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from files_named_in(inner)


def test_families_are_known() -> None:
    assert sorted([*FILELESS, "areas", "skies", "surfaces", "vehicles"]) == FAMILIES


@pytest.mark.parametrize("family", FAMILIES)
def test_every_folder_of_assets_is_an_asset(family: str) -> None:
    folders = {path.name for path in (catalog.data_root("assets") / family).iterdir()}
    assert folders == set(catalog.names(family))


@pytest.mark.parametrize(("family", "name"), ASSETS)
def test_asset_has_a_licence_and_all_its_files(family: str, name: str) -> None:
    entry = catalog.find(family, name)
    assert entry.meta["licence"] == "BSD-3-Clause"
    coupled = "units" in entry.meta
    if family == "vehicles":
        borrowed = coupled or "turns" in entry.meta
        held = {BODIES: "parts" in entry.meta and not borrowed, FULL: "full" in entry.meta}
        named = {file for file, there in held.items() if there}
        assert coupled == ("parts" not in entry.meta)
    else:
        assert not coupled
        named = set(files_named_in(dict(entry.meta)))
        # Some families are built when they are first needed.
        assert bool(named) != (family in FILELESS)
    present = {path.name for path in entry.folder.iterdir()} - {"asset.yaml", "baked.yaml"}
    assert named == present
    assert all((entry.folder / file).stat().st_size > 0 for file in named)


@pytest.mark.parametrize("name", [n for n in SINGLE if "turns" in catalog.find("vehicles", n).meta])
def test_borrowed_meshes_are_another_vehicles_own(name: str) -> None:
    meta = catalog.find("vehicles", name).meta
    owner = catalog.find("vehicles", meta["turns"]).meta
    assert set(meta["parts"]) <= set(owner["parts"]) and set(meta["far"]) <= set(owner["far"])


@pytest.mark.parametrize("name", catalog.names("surfaces"))
def test_surface_reflects_less_than_it_gets(name: str) -> None:
    meta = catalog.find("surfaces", name).meta
    assert len(meta["albedo"]) == 3
    assert all(0.0 < value <= BRIGHTEST for value in meta["albedo"])
    assert meta["scale"] > 0.0


def colours_in(value: Any) -> Iterator[list[float]]:
    """Base colours anywhere in a material."""
    if isinstance(value, dict):
        if value.get("type") == "rgb":
            yield (
                list(value["value"]) if not isinstance(value["value"], float) else [value["value"]]
            )
        for inner in value.values():
            yield from colours_in(inner)


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_material_reflects_less_than_it_gets(name: str) -> None:
    base = MATERIALS[name].get("base_color", {})
    assert all(0.0 <= part <= BRIGHTEST for colour in colours_in(base) for part in colour)


@pytest.mark.parametrize("name", SINGLE)
def test_vehicle_uses_known_materials_and_has_a_far_level(name: str) -> None:
    meta = catalog.find("vehicles", name).meta
    assert meta["parts"] and meta["far"]
    assert {*meta["parts"], *meta["far"], *meta.get("full", ()), *meta.get("wheel", ())} <= set(
        MATERIALS
    )
    if "aircraft" in meta["vclass"] or "drone" in meta["vclass"]:
        # Gates of the largest category F take a span of 80 m (ICAO Annex 14).
        assert 0.4 < meta["width"] < 80.0
        return
    # SUMO's longest carriages have 26.4 m; roads allow 2.55 m, rails 3.15 m, locks 11.4 m.
    afloat = "ship" in name or "ship" in meta["vclass"]
    assert 1.0 < meta["length"] < (50.0 if afloat else 30.0)
    widest = 2.6 if meta["build"] != "hull" else 11.4 if afloat else 3.15
    assert 0.6 < meta["width"] < widest


@pytest.mark.parametrize("name", COUPLED)
def test_coupled_vehicle_is_as_long_and_wide_as_its_units(name: str) -> None:
    meta = catalog.find("vehicles", name).meta
    units = [(catalog.find("vehicles", row["model"]).meta, row["at"]) for row in meta["units"]]
    assert len(units) >= 2
    assert [at for _, at in units] == sorted((at for _, at in units), reverse=True)
    assert units[0][1] == 0.0
    end = max(unit["length"] - at for unit, at in units)
    assert end == pytest.approx(meta["length"], abs=0.05)
    assert max(unit["width"] for unit, _ in units) == pytest.approx(meta["width"], abs=0.05)


def test_kinds_of_presets() -> None:
    assert KINDS == ["camera", "quality", "scene", "sky", "weather"]


@pytest.mark.parametrize("name", presets("scene"))
def test_scene_template_is_valid(name: str) -> None:
    job = make_job({"template": name, "scenario": {"folder": "."}})
    assert job.template == name


@pytest.mark.parametrize("name", presets("quality"))
def test_quality_preset_is_valid(name: str) -> None:
    quality = quality_preset(name, together=True)
    assert quality.purpose
    for used in (quality, quality.by_itself):
        assert used.spp % min(used.pass_spp, used.spp) == 0, "passes are whole"
        side = math.isqrt(min(used.pass_spp, used.spp))
        assert min(used.pass_spp, used.spp) % side == 0, "the sampler's pattern rounds others up"


@pytest.mark.parametrize("name", presets("sky"))
def test_sky_preset_can_be_chosen(name: str) -> None:
    content = catalog.template("sky", name)
    assert content["purpose"]
    assert SkySettings(preset=name).preset == name
    if "clouds" in content:
        catalog.find("skies", content["clouds"])


@pytest.mark.parametrize("name", presets("camera"))
def test_view_can_be_chosen(name: str) -> None:
    assert 2 <= catalog.template("camera", name)["fov"] <= 170
    assert LagrangianCamera(mode="lagrangian", vehicle="any", view=name).view == name


def test_defaults_of_the_scene_file_exist() -> None:
    fields = Job.model_fields
    assert fields["template"].default in catalog.template_names("scene")
    assert fields["quality"].default in catalog.template_names("quality")
    job = make_job({"scenario": {"folder": "."}})
    catalog.find("surfaces", job.ground.texture)
    catalog.find("surfaces", job.roads.surface)


@pytest.mark.parametrize("kind", KINDS)
def test_unknown_preset_is_refused_with_a_suggestion(kind: str) -> None:
    known = presets(kind)[0]
    with pytest.raises(ConfigError, match=f"did you mean '{known}'"):
        catalog.template(kind, known + "x")


def test_unknown_asset_is_refused_with_a_suggestion() -> None:
    with pytest.raises(ConfigError, match="did you mean 'asphalt'"):
        catalog.find("surfaces", "asphlat")


def test_missing_data_is_an_incomplete_installation() -> None:
    with pytest.raises(ConfigError, match="incomplete"):
        catalog.data_root("no_such_folder")


def test_installed_data_wins_over_the_repository(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, outside = tmp_path / "package" / "_data", tmp_path
    monkeypatch.setattr(catalog, "_DATA_ROOTS", (inside, outside))
    (outside / "assets").mkdir()
    assert catalog.data_root("assets") == outside / "assets"
    (inside / "assets").mkdir(parents=True)
    assert catalog.data_root("assets") == inside / "assets"


@pytest.mark.parametrize("folder", EXAMPLES, ids=lambda path: path.name)
def test_example_loads_and_finds_its_files(folder: Path) -> None:
    job = load_job(folder / "scene.yaml")
    files = scenario_files(job)
    named = [files.network, *files.trajectories, *files.signals, *files.additional]
    assert all(path.is_file() for path in [*named, *object_files(job)])
    assert not files.missing
    assert {shot.camera for shot in job.shots} <= set(job.cameras)
    assert {mode_of(camera) for camera in job.cameras.values()} == {
        "eulerian",
        "lagrangian",
        "cinematic",
    }


def mode_of(camera: CameraSettings) -> str:
    return camera.mode
