"""Makes the manual's sheet of invented towns: python tools/make_towns.py [FOLDER]

Six networks that SUMO ships, none with a house of its own, driven at random; each is given to
`init`, and its proposed camera above shows it without a town and with one. Needs SUMO (`pip install
"sumo3dviz_pt[sumo]"`); takes about half an hour on two cores, and 100 MB in the folder.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from PIL import Image

SHEET = Path(__file__).resolve().parents[1] / "docs" / "images" / "towns.jpg"
NETWORKS = {
    "Brunswick": ("game/fokr_bs_demo/fokr_bs.net.xml.gz", 0.5),
    "Berlin": ("game/DRT/osm.net.xml", 1.0),
    "Ingolstadt": ("game/fkk_in/ingolstadt.net.xml.gz", 0.5),
    "made up": ("game/kuehne/kuehne.net.xml", 0.5),
    "Koenigs Wusterhausen": ("game/A10KW/osm.net.xml", 0.5),
    "RiLSA": ("sumolib/scenario/scenarios/RealWorld/RiLSA_example3/net.net.xml", 0.5),
}
"""Where it lies, and every how many seconds somebody departs."""

END = 240
SIZE = 480, 270
OPTIONS = ["--camera", "overview", "--quality", "standard", "--size", f"{SIZE[0]}x{SIZE[1]}"]


def shipped() -> Path:
    """Where SUMO's package keeps its scripts and examples."""
    found = find_spec("sumo")
    if found is None or found.origin is None:
        raise SystemExit('SUMO is not installed; next: pip install "sumo3dviz_pt[sumo]"')
    return Path(found.origin).parent / "tools"


def run(*words: str | Path) -> None:
    """Run a program; its output is shown only if it fails."""
    done = subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, words))}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def driven(name: str, folder: Path) -> Path:
    """Drive through a network at random and propose a scene; return its file."""
    source, period = NETWORKS[name]
    network = folder / ("net.net.xml.gz" if source.endswith(".gz") else "net.net.xml")
    network.write_bytes((shipped() / source).read_bytes())
    routes = folder / "routes.rou.xml"
    with tempfile.TemporaryDirectory() as work:
        trips = Path(work) / "trips.xml"
        words = ("-e", str(END), "-p", str(period), "--seed", "7", "--fringe-factor", "3")
        script = shipped() / "randomTrips.py"
        run(sys.executable, script, "-n", network, "-o", trips, "-r", routes, *words)
        log = ("--fcd-output", folder / "fcd.xml", "--step-length", "0.5", "--end", str(END))
        run("sumo", "-n", network, "-r", routes, *log, "--ignore-route-errors", "--no-step-log")
        routes.unlink()
    scene = folder / "scene.yaml"
    run("sumo3dviz-pt", "init", folder, "-o", scene, "--force")
    return scene


def pictured(scene: Path, town: str) -> Image.Image:
    """Render the proposed camera above in the middle of the proposed shot."""
    times = re.findall(r"time: ([0-9.]+), position", scene.read_text(encoding="utf-8"))
    picture = scene.with_name(f"{town}.png")
    words = ("--time", times[len(times) // 2], "--set", f"street.town={town}", "--overwrite")
    run("sumo3dviz-pt", "still", scene, *OPTIONS, *words, "-o", picture)
    with Image.open(picture) as opened:
        return opened.convert("RGB")


def main() -> int:
    """Make the sheet: six rows, without and with a town."""
    with tempfile.TemporaryDirectory() as own:
        root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(own)
        sheet = Image.new("RGB", (2 * SIZE[0], len(NETWORKS) * SIZE[1]))
        for row, name in enumerate(NETWORKS):
            folder = root / name.replace(" ", "_")
            folder.mkdir(parents=True, exist_ok=True)
            scene = driven(name, folder)
            for column, town in enumerate(("none", "auto")):
                sheet.paste(pictured(scene, town), (column * SIZE[0], row * SIZE[1]))
        sheet.save(SHEET, quality=86)
    print(f"wrote {SHEET}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
