"""The command line's commands and options."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from sumo3dviz_pt.errors import ConfigError

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline import Request

PROGRAM = "sumo3dviz-pt"


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        """Leave with exit code 2."""
        raise ConfigError(f"{message} (see {self.prog} --help)")


def build_parser() -> argparse.ArgumentParser:
    """All commands and their options."""
    from sumo3dviz_pt import __version__

    parser = _Parser(
        prog=PROGRAM, description="Path-traced stills and films of SUMO traffic simulations."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for add in (
        _add_demo,
        _add_init,
        _add_check,
        _add_still,
        _add_render,
        _add_develop,
        _add_converge,
        _add_report,
        _add_motion,
        _add_view,
        _add_assets,
        _add_doctor,
    ):
        add(commands)
    return parser


def _add_demo(commands: Any) -> None:
    sub = commands.add_parser("demo", help="render the bundled example: demo.mp4 and demo.png")
    sub.add_argument("-o", "--output", type=Path, default=Path(), help="folder [.]")
    sub.add_argument("--quality", default="preview", help="quality preset [preview]")
    sub.add_argument("--variant", default="llvm", help="llvm, cuda or scalar [llvm]")
    sub.add_argument("--size", type=_size, default=(640, 360), help="WxH [640x360]")


def _add_init(commands: Any) -> None:
    sub = commands.add_parser("init", help="write a commented, running scene file")
    sub.add_argument("scenario", type=Path, help=".sumocfg, or a folder searched by content")
    sub.add_argument("--network", type=Path, help="this network instead of the one found")
    sub.add_argument("--trajectories", type=Path, action="append", default=[], help="this FCD log")
    sub.add_argument("--signals", type=Path, action="append", default=[], help="this signal log")
    sub.add_argument("--additional", type=Path, action="append", default=[], help="more POIs")
    sub.add_argument("-o", "--output", type=Path, default=Path("scene.yaml"), help="scene file")
    sub.add_argument("--template", default="highway_day", help="scene template [highway_day]")


def _add_check(commands: Any) -> None:
    sub = commands.add_parser("check", help="validate a scene; say what it holds and leaves out")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--json", action="store_true", help="as JSON")
    instead = sub.add_mutually_exclusive_group()
    instead.add_argument(
        "--stress", action="store_true", help="render the scene's edges and judge every picture"
    )
    instead.add_argument(
        "--motion", action="store_true", help="measure how everyone in the log moves instead"
    )
    sub.add_argument("--camera", help="whose shot --stress starts from [the first shot's]")
    sub.add_argument("--time", type=float, help="its time, SUMO's [s; the shot's first]")
    sub.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="CASE",
        help='run only these cases of --stress, such as "sun*"',
    )
    sub.add_argument("--variant", default="llvm", help="llvm, cuda or scalar [llvm]")
    _add_overrides(sub)


def _add_still(commands: Any) -> None:
    sub = commands.add_parser("still", help="render one image")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--time", type=float, required=True, help="SUMO's time [s]")
    sub.add_argument("-o", "--output", type=Path, required=True, help="out.png or out.exr")
    _add_request(sub)


def _add_render(commands: Any) -> None:
    sub = commands.add_parser("render", help="render films; several scenes make a batch")
    sub.add_argument("scene", type=Path, nargs="+")
    sub.add_argument("--from", dest="start", type=float, help="first frame's time [s]")
    sub.add_argument("--to", dest="end", type=float, help="time after the last frame [s]")
    sub.add_argument("--fps", type=float, help="frames per second")
    sub.add_argument("--resume", action="store_true", help="keep frames that match")
    sub.add_argument("--frames", type=_range, help="A:B renders only these frames, no film")
    sub.add_argument("--discard-frames", action="store_true", help="delete frames afterwards")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        help="film.mp4; {scene} and {shot} are filled in",
    )
    _add_request(sub)


def _add_develop(commands: Any) -> None:
    sub = commands.add_parser("develop", help="pictures from EXR frames, without rendering again")
    sub.add_argument("frames", type=Path, help="folder of frames, or one .exr")
    sub.add_argument("-o", "--output", type=Path, required=True, help="film.mp4 or out.png")
    sub.add_argument("--exposure", type=float, help="EV instead of the stored one")
    sub.add_argument("--tone", help="tone curve instead of the stored one")
    sub.add_argument("--fps", type=float, default=25.0, help="frames per second [25]")
    sub.add_argument("--codec", default="h264", help="video codec [h264]")


def _add_report(commands: Any) -> None:
    sub = commands.add_parser("report", help="a film's frames in figures, or two films compared")
    sub.add_argument("frames", type=Path, help="folder of frames, or the film beside it")
    sub.add_argument("--against", type=Path, help="frames of the same times to compare with")
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder for the report")


def _add_motion(commands: Any) -> None:
    sub = commands.add_parser("motion", help="draw how one road user moves, on a map and over time")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--vehicle", metavar="ID", required=True, help="its id; persons count too")
    sub.add_argument("--from", dest="start", type=float, metavar="T", help="first time [s]")
    sub.add_argument("--to", dest="end", type=float, metavar="T", help="last time [s]")
    sub.add_argument("-o", "--output", type=Path, required=True, help="plot.png")
    _add_overrides(sub)


def _add_converge(commands: Any) -> None:
    sub = commands.add_parser("converge", help="error against run time of this very scene")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--time", type=float, required=True, help="SUMO's time [s]")
    sub.add_argument("-o", "--output", type=Path, required=True, help="folder of the report")
    sub.add_argument("--camera", help="a name from the scene's cameras")
    sub.add_argument("--size", type=_size, default=(480, 270), help="WxH [480x270]")
    sub.add_argument("--top", type=int, default=64, help="most samples that are judged [64]")
    sub.add_argument("--budget", type=float, metavar="SECONDS", help="begin nothing after it")
    sub.add_argument("--variant", default="llvm", help="llvm, cuda or scalar [llvm]")
    _add_overrides(sub)


def _add_view(commands: Any) -> None:
    sub = commands.add_parser("view", help="walk through a scene in the browser")
    sub.add_argument("scene", type=Path)
    sub.add_argument("--port", type=int, default=0, help="to listen on [a free one]")
    sub.add_argument("--size", type=_size, default=(480, 270), help="of its pictures [480x270]")
    sub.add_argument("--from", dest="start", type=float, metavar="T", help="first time [s]")
    sub.add_argument("--to", dest="end", type=float, metavar="T", help="last time [s]")
    sub.add_argument("--token", help="the secret in the address [a new one each time]")
    sub.add_argument("--variant", default="llvm", help="llvm or cuda [llvm]")
    _add_overrides(sub)


def _add_assets(commands: Any) -> None:
    sub = commands.add_parser("assets", help="the library: as a table, as pictures, made again")
    sub.add_argument("action", choices=("list", "sheet", "build"), help="what to do")
    sub.add_argument("chosen", nargs="*", help="families, or family/name to build; default all")
    sub.add_argument("-o", "--output", type=Path, help="folder for sheets, or to build in")
    sub.add_argument("--quality", default="preview", help="of the sheets [preview]")
    sub.add_argument("--size", type=_size, default=(480, 270), help="of each picture [480x270]")


def _add_doctor(commands: Any) -> None:
    commands.add_parser("doctor", help="versions, variant, libLLVM, threads, memory, ffmpeg")


def _add_request(sub: argparse.ArgumentParser) -> None:
    """Choices that still and render share."""
    sub.add_argument("--camera", help="a name from the scene's cameras")
    sub.add_argument("--quality", help="quality preset")
    sub.add_argument("--size", type=_size, help="WxH [px]")
    sub.add_argument("--spp", type=int, help="samples per pixel")
    sub.add_argument("--seed", type=int, help="seed")
    sub.add_argument("--variant", default="llvm", help="llvm, cuda or scalar [llvm]")
    _add_overrides(sub)


def _add_overrides(sub: argparse.ArgumentParser) -> None:
    sub.add_argument(
        "--set", action="append", default=[], metavar="KEY.PATH=VALUE", help="any scene file value"
    )


def _size(text: str) -> tuple[int, int]:
    """Read WxH."""
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise argparse.ArgumentTypeError(f"{text!r} is no size; write it like 1280x720")
    return int(width), int(height)


def _range(text: str) -> tuple[int, int]:
    """Read A:B."""
    first, _, after = text.partition(":")
    if not (first.isdigit() and after.isdigit()):
        raise argparse.ArgumentTypeError(f"{text!r} is no range; write it like 10:20")
    return int(first), int(after)


def overrides_of(options: argparse.Namespace) -> dict[str, str]:
    """What --set says: values by key.

    Raises:
        ConfigError: If a key has no value.
    """
    pairs = [item.partition("=") for item in options.set]
    for key, sign, _ in pairs:
        if not sign:
            raise ConfigError(f"{key!r} has no value; write it like quality=draft", key="--set")
    return {key.strip(): value for key, _, value in pairs}


def request_of(options: argparse.Namespace) -> Request:
    """What still and render ask for."""
    from sumo3dviz_pt.pipeline import Request

    return Request(
        options.camera, options.quality, options.size, options.spp, options.seed, options.variant
    )
