"""Looks at an installation and says what is missing and how to get it."""

from __future__ import annotations

import os
import platform

from sumo3dviz_pt.errors import Sumo3dvizError
from sumo3dviz_pt.provenance import versions


def examine() -> tuple[bool, list[str]]:
    """Whether rendering works here, and what was found, line by line."""
    lines = [f"Python      {platform.python_version()} on {platform.platform()}"]
    lines += [f"{name:<11} {version}" for name, version in versions().items()]
    lines.append(f"CPU threads {os.cpu_count()}")
    memory = physical_memory()
    if memory:
        lines.append(f"memory      {memory / 2**30:.1f} GiB")
    healthy, about_renderer = _renderer()
    lines += about_renderer
    encodes, about_ffmpeg = _ffmpeg()
    lines.append(about_ffmpeg)
    return healthy and encodes, lines


def physical_memory() -> int:
    """Physical memory [bytes], or 0 where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 0


def _renderer() -> tuple[bool, list[str]]:
    """Which variant works."""
    try:
        from sumo3dviz_pt.render.backend import choose_backend, llvm_description

        backend = choose_backend()
    except (Sumo3dvizError, ImportError) as error:
        return False, [f"renderer    does not work: {error}"]
    lines = [f"renderer    {backend.variant}", f"libLLVM     {llvm_description()}"]
    if backend.note:
        lines.append(f"note        {backend.note}")
    return True, lines


def _ffmpeg() -> tuple[bool, str]:
    """Whether films can be encoded."""
    import imageio_ffmpeg

    try:
        version = imageio_ffmpeg.get_ffmpeg_version()
    except RuntimeError as error:
        return False, f"ffmpeg      does not work: {error}"
    return True, f"ffmpeg      {version}"
