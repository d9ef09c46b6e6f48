"""Options that several commands share."""

from __future__ import annotations

import argparse
import difflib
import shlex
import shutil
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from sumo3dviz_pt.errors import ConfigError

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Request

PROGRAM = "sumo3dviz-pt"


_LISTED: Mapping[str, tuple[str, ...]] = {
    "--quality": ("quality",),
    "--template": ("template",),
    "--codec": ("output.codec",),
    "--tone": ("output.tone",),
    "--set": (
        "template",
        "quality",
        "sky.preset",
        "cameras.NAME.view",
        "output.codec",
        "output.tone",
    ),
}
"""Keys of the scene file whose names are listed by the help of commands with an option."""


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, suggests what was meant, and lists names."""

    def error(self, message: str) -> NoReturn:
        """Leave with exit code 2."""
        raise ConfigError(f"{message} (see {self.prog} --help)")

    def format_help(self) -> str:
        """Help, with the names that can be chosen."""
        options = self._option_string_actions
        keys = dict.fromkeys(key for option in options for key in _LISTED.get(option, ()))
        return super().format_help() + _names(keys)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; options that do not exist are an error that suggests one."""
        found, unknown = self.parse_known_args(args, namespace)
        if unknown:
            command = _parser_of(self, getattr(found, "command", None))
            word = next((each for each in unknown if each.startswith("-")), unknown[0])
            hint = nearest(word.partition("=")[0], command._option_string_actions)
            command.error(f"{word!r} is not understood{hint}")
        return found

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse what is no choice; suggest one."""
        if action.choices is not None and value not in action.choices:
            known = list(map(str, action.choices))
            hint = nearest(str(value), known) or f"; known: {', '.join(known)}"
            raise argparse.ArgumentError(action, f"{value!r} is unknown{hint}")


def _parser_of(parser: argparse.ArgumentParser, command: str | None) -> argparse.ArgumentParser:
    """The parser of a command."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction) and command in action.choices:
            found: argparse.ArgumentParser = action.choices[command]
            return found
    return parser


def nearest(word: str, known: Iterable[str]) -> str:
    """End of a sentence that names the nearest of many words, if there is one."""
    near = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _names(keys: Iterable[str]) -> str:
    """Names that can be chosen, key by key."""
    from sumo3dviz_pt.pipeline.choices import names_for

    width = min(100, shutil.get_terminal_size().columns)
    lines = [
        textwrap.fill(
            ", ".join(names_for(key)),
            width,
            initial_indent=f"  {key:<18}  ",
            subsequent_indent=" " * 22,
            break_on_hyphens=False,
        )
        for key in keys
    ]
    return "\n".join(["", "names:", *lines, ""]) if lines else ""


def add_verbosity(parser: argparse.ArgumentParser, default: Any) -> None:
    """Let people choose how much is said while work goes on."""
    much = parser.add_mutually_exclusive_group()
    for flags, level, meaning in (
        (("-v", "--verbose"), 1, "say more about what is done"),
        (("-q", "--quiet"), -1, "say nothing but errors and results"),
    ):
        much.add_argument(
            *flags,
            dest="verbosity",
            action="store_const",
            const=level,
            default=default,
            help=meaning,
        )


def add_request(sub: argparse.ArgumentParser) -> None:
    """Choices that still and render share."""
    sub.add_argument("--camera", help="a name from the scene's cameras")
    sub.add_argument("--quality", help="quality preset")
    sub.add_argument("--size", type=picture_size, help="WxH [px]")
    sub.add_argument("--spp", type=int, help="samples per pixel")
    sub.add_argument("--seed", type=int, help="seed")
    sub.add_argument("--variant", default="llvm", help="llvm, cuda or scalar [llvm]")
    add_overrides(sub)


def add_overwrite(sub: argparse.ArgumentParser, what: str = "replace what exists") -> None:
    """Let what exists be replaced; nothing is overwritten unasked."""
    sub.add_argument("--overwrite", action="store_true", help=what)


def add_force(sub: argparse.ArgumentParser) -> None:
    """Let a scene file that exists be replaced."""
    sub.add_argument(
        *("--force", "--overwrite"), action="store_true", help="replace a scene file that exists"
    )


def add_overrides(sub: argparse.ArgumentParser) -> None:
    """Let every value of the scene file be set."""
    sub.add_argument(
        "--set", action="append", default=[], metavar="KEY.PATH=VALUE", help="any scene file value"
    )


def picture_size(text: str) -> tuple[int, int]:
    """Read WxH."""
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise argparse.ArgumentTypeError(f"{text!r} is no size; write it like 1280x720")
    return int(width), int(height)


def frame_range(text: str) -> tuple[int, int]:
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
    from sumo3dviz_pt.pipeline.production import Request

    return Request(
        options.camera,
        options.quality,
        options.size,
        options.spp,
        options.seed,
        options.variant,
        command_in(options.words),
    )


def command_in(words: Sequence[str]) -> str:
    """A command as pictures tell it: as given, but for where they go, so that bytes stay alike."""
    kept: list[str] = []
    skip = False
    for word in words:
        name, sign, _ = word.partition("=")
        long = len(name) > len("--o") and "--output".startswith(name)
        if not (skip or long or word.startswith("-o")):
            kept.append(word)
        skip = not skip and ((long and not sign) or word == "-o")
    return shlex.join([PROGRAM, *kept])
