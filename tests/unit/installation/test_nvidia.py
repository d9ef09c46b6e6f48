"""What NVIDIA's driver says of itself."""

from __future__ import annotations

import re

import pytest

from sumo3dviz_pt.installation.dependencies import find_driver

LIBCUDA, OPTIX = "libcuda.so.1", "libnvoptix.so.1"


class Cuda:
    """Functions of a driver's library."""

    def __init__(self, *, gpus: int = 1, error: int = 0) -> None:
        self.gpus, self.error = gpus, error

    def cuDriverGetVersion(self, found) -> int:
        found._obj.value = 12040
        return 0

    def cuInit(self, flags: int) -> int:
        return self.error

    def cuDeviceGetCount(self, found) -> int:
        found._obj.value = self.gpus
        return 0

    def cuDeviceGetName(self, name, size: int, device: int) -> int:
        name.value = b"NVIDIA H200"
        return 0

    def cuDeviceTotalMem_v2(self, found, device: int) -> int:
        found._obj.value = 150 << 30
        return 0


def machine(**libraries):
    """Loads what a machine has."""
    known = {LIBCUDA: libraries.get("cuda"), OPTIX: libraries.get("optix")}

    def load(name: str):
        if known.get(name) is None:
            raise OSError(name)
        return known[name]

    return load


@pytest.fixture(autouse=True)
def linux(monkeypatch):
    monkeypatch.setattr("sumo3dviz_pt.installation.dependencies._WINDOWS", False)
    monkeypatch.setattr("sumo3dviz_pt.installation.dependencies._CUDA", LIBCUDA)


def test_a_whole_driver_tells_version_and_device() -> None:
    found = find_driver(machine(cuda=Cuda(), optix=object()))
    assert (found.cuda, found.device, found.optix) == ("12.4", "NVIDIA H200", True)
    assert found.memory == 150 << 30
    assert not found.problem


@pytest.mark.parametrize(
    ("libraries", "said"),
    [
        ({}, "there is no NVIDIA driver"),
        ({"cuda": Cuda(error=100)}, r"finds no GPU \(CUDA error 100\)"),
        ({"cuda": Cuda(gpus=0)}, r"finds no GPU \(it counts none\)"),
        ({"cuda": Cuda()}, "has no OptiX"),
    ],
)
def test_what_is_missing_is_one_sentence(libraries, said) -> None:
    problem = find_driver(machine(**libraries)).problem
    assert re.search(said, problem) and "\n" not in problem
