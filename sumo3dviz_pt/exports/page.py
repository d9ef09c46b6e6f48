"""Writes a folder with a page that shows a scene in a browser, without a server or the network.

The page draws with three.js, of which a copy comes with trimesh's own viewer.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import shutil
import tempfile
import zipfile
from pathlib import Path

from sumo3dviz_pt.errors import InstallationError
from sumo3dviz_pt.exports.gltf import gltf
from sumo3dviz_pt.exports.scene import ExportedScene

_PAGE = Path(__file__).with_name("page")
_BEGIN, _END = "<script>", "var camera,controls,scene"
_NEEDED = ("THREE.GLTFLoader=", "AnimationMixer", "WebGLRenderer")
_FILES = {"index.html", "page.js", "scene.js", "three.js"}
_NOTE = "three.js, MIT licence: https://threejs.org"


def three_js() -> str:
    """Return three.js with its reader of glTF, as one classic script.

    Raises:
        InstallationError: If the trimesh that is installed has none that we know.
    """
    import trimesh

    place = Path(trimesh.__file__).parent / "resources" / "templates" / "viewer.zip"
    try:
        with zipfile.ZipFile(place) as packed:
            text = packed.read(packed.namelist()[0]).decode("utf-8")
        script = text[text.index(_BEGIN) + len(_BEGIN) : text.index(_END)]
    except (OSError, ValueError, IndexError, zipfile.BadZipFile):
        script = ""
    if not all(word in script for word in _NEEDED):
        raise InstallationError(
            f"trimesh {trimesh.__version__} has no three.js that the page can use;"
            ' install another one: pip install "trimesh>=4.2,<6"'
        )
    return f"/* {_NOTE} */\n{script}\n"


def is_page(folder: Path) -> bool:
    """Return whether a folder holds such a page and nothing else."""
    return {file.name for file in folder.iterdir()} == _FILES


def write_page(scene: ExportedScene, folder: Path, *, title: str) -> None:
    """Write the page's folder, whole or not at all.

    Args:
        scene: What it shows.
        folder: It is made, or replaced.
        title: Of the page.

    Raises:
        InstallationError: As in `three_js`.
        OSError: If it cannot be written.
    """
    script = three_js()
    said = {
        "title": title,
        "start": float(scene.times[0]),
        "end": float(scene.times[-1]),
        "cameras": [camera.name for camera in scene.cameras],
        "dark": scene.dark,
        # The page is y up.
        "sun": None if scene.sun is None else [scene.sun[0], scene.sun[2], -scene.sun[1]],
        "gltf": base64.b64encode(gzip.compress(gltf(scene), 6, mtime=0)).decode(),
    }
    work = Path(tempfile.mkdtemp(dir=folder.absolute().parent, prefix=f".{folder.name}-"))
    try:
        page = (_PAGE / "index.html").read_text(encoding="utf-8")
        files = {
            "index.html": page.replace("$TITLE", html.escape(title)),
            "page.js": (_PAGE / "page.js").read_text(encoding="utf-8"),
            "three.js": script,
            "scene.js": f"window.SCENE = {json.dumps(said)};\n",
        }
        for name, text in files.items():
            (work / name).write_text(text, encoding="utf-8", newline="\n")
        work.chmod(0o755)
        if folder.exists():
            shutil.rmtree(folder)
        work.rename(folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)
