"""What all tests share."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

# Tests run side by side: threads of OpenBLAS beyond the first wait for a processor by spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import searching as searching


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Bodies in full detail are built once for all tests, never into the user's cache."""
    base = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        # Tests that run side by side have folders of their own below a common one.
        own = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "cache"
        # CI's runs of tests, one after the other, name a folder that all of them fill.
        folder = Path(os.environ.get("SUMO3DVIZ_PT_TESTS_CACHE") or own)
        folder.mkdir(parents=True, exist_ok=True)
        patch.setenv("SUMO3DVIZ_PT_CACHE", str(folder))
        yield folder


@pytest.fixture
def compiled() -> Iterator[None]:
    """Our own kernel is here, which is compiled; who comes later finds the variant as it was."""
    from sumo3dviz_pt.render.backend import choose_backend

    if not choose_backend("llvm").jit:
        pytest.skip("only our own kernel can do this")
    yield
    choose_backend("llvm")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring files with slow tests first, and unit tests last.

    Processes take one file after the other. Short files at the end let them end together;
    a file that renders for a minute would leave the others idle.
    """
    for item in items:
        # Laws go over the same lines hundreds of times: measuring that each time tells nothing new.
        if item.path.parent.name in ("property", "acceptance"):
            item.add_marker("no_cover")
    long = {item.path for item in items if item.get_closest_marker("slow")}
    unit = Path(__file__).parent / "unit"
    items.sort(key=lambda item: (item.path not in long, item.path.is_relative_to(unit)))
