"""A page that shows all films of a study with their levels."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import StudyContent
from sumo3dviz_pt.files.whole import write_whole

_STYLE = (
    "body { background: #777; color: #fff; font-family: sans-serif }"
    " figure { display: inline-block; margin: .5em; vertical-align: top; max-width: 320px }"
    " video { width: 320px } figcaption { font-size: .9em }"
)


def write_sheet(folder: Path, content: StudyContent, thumbnails: Mapping[str, str]) -> Path:
    """Write `contact_sheet.html`: every film as a player, under its picture and levels.

    Args:
        folder: The study's.
        content: Its films.
        thumbnails: Pictures by the films' names, relative to the folder.
    """
    title = html.escape(content.words.title)
    lines = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        f"<style>{_STYLE}</style></head><body><h1>{title}</h1>",
    ]
    for clip in content.films:
        profiles = [profile for profile, film in content.clips.items() if film == clip]
        words = "<br>".join(
            html.escape(", ".join(f"{key} {level}" for key, level in content.named(p).items()))
            for p in profiles
        )
        source, poster = (
            html.escape(path, quote=True) for path in (clip.file, thumbnails[clip.name])
        )
        lines.append(
            f'<figure><video src="{source}" poster="{poster}" controls muted loop preload="none">'
            f"</video><figcaption><b>{html.escape(clip.name)}</b><br>{words}</figcaption></figure>"
        )
    path = folder / "contact_sheet.html"
    write_whole(path, "\n".join([*lines, "</body></html>", ""]))
    return path
