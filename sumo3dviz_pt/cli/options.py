"""The parser, the options that several commands share, and how errors and progress are shown."""

from __future__ import annotations

import argparse
import difflib
import logging
import re
import shlex
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, NoReturn

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import meaning
from sumo3dviz_pt.job.values import VARIANT, VARIANTS

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Request
    from sumo3dviz_pt.pipeline.steps import WorkStep


PROGRAM = "sumo3dviz-pt"


_SET_LISTS = (
    "template",
    "quality",
    "sky.preset",
    "cameras.NAME.view",
    "output.codec",
    "output.tone",
)
"""Keys of the scene file whose names are listed by the help of commands that take `--set`."""


class Parser(argparse.ArgumentParser):
    """A parser that says in one line what is wrong, suggests what was meant, and lists names.

    Attributes:
        settings: Keys of the scene file, by the options that stand for them.
        words: Parsers of what stands after a word that the first argument may be.
    """

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self.settings: dict[str, str] = {}
        self.words: dict[str, Parser] = {}
        # Places west or south of the origin, such as -30,5, are values and no options.
        self._negative_number_matcher = re.compile(r"^-\.?\d[\d.,e+-]*$")

    def add_word(self, word: str, about: str) -> Parser:
        """Let a word as the first argument have options of its own, as in `study pack FOLDER`.

        Args:
            word: The word; a file of that name is reached as ./WORD.
            about: What it does.
        """
        self.words[word] = Parser(prog=f"{self.prog} {word}", description=about)
        add_verbosity(self.words[word], argparse.SUPPRESS)
        return self.words[word]

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse what is known; what stands after a word is that word's."""
        if args and args[0] in self.words:
            return self.words[args[0]].parse_args(args[1:], namespace), []
        return super().parse_known_args(args, namespace)

    def add_setting(
        self, flag: str, key: str, *, before: str = "", after: str = "", **more: Any
    ) -> None:
        """Add an option that stands for a key of the scene file; its help is the key's own.

        Args:
            flag: The option, such as `--fps`.
            key: Dotted, such as `output.fps`.
            before: Words that the help begins with.
            after: Words that the help ends with, such as what holds without the option.
            more: As for `add_argument`.
        """
        self.settings[flag] = key
        self.add_argument(flag, help=f"{before}{meaning(key)}{after}", **more)

    def error(self, message: str) -> NoReturn:
        """Leave with exit code 2."""
        raise ConfigError(f"{message} (see {self.prog} --help)")

    def format_help(self) -> str:
        """Help, with the names that can be chosen."""
        keys = [*self.settings.values()]
        keys += _SET_LISTS if "--set" in self._option_string_actions else ()
        words = [f"  {word:<18}  {own.description}" for word, own in self.words.items()]
        more = "\n".join(["", "words:", *words, ""]) if words else ""
        return super().format_help() + more + _names(dict.fromkeys(keys))

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; options that do not exist are an error that suggests one."""
        parsed, unknown = self.parse_known_args(args, namespace)
        if unknown:
            command = _parser_of(self, getattr(parsed, "command", None))
            word = next((each for each in unknown if each.startswith("-")), unknown[0])
            hint = nearest(word.partition("=")[0], command._option_string_actions)
            if self._negative_number_matcher.match(word):
                hint = "; numbers of one place are written without spaces, such as -400,-6.5"
            command.error(f"{word!r} is not understood{hint}")
        return parsed

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse what is no choice; suggest one."""
        if action.choices is not None and value not in action.choices:
            known = list(map(str, action.choices))
            hint = nearest(str(value), known) or f"; known: {', '.join(known)}"
            raise argparse.ArgumentError(action, f"{value!r} is unknown{hint}")


def _parser_of(parser: argparse.ArgumentParser, command: str | None) -> argparse.ArgumentParser:
    """Return the parser of a command."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction) and command in action.choices:
            chosen: argparse.ArgumentParser = action.choices[command]
            return chosen
    return parser


def nearest(word: str, known: Iterable[str]) -> str:
    """End of a sentence that names the nearest of many words, if there is one."""
    near = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _names(keys: Iterable[str]) -> str:
    """Return the names that can be chosen, key by key."""
    from sumo3dviz_pt.pipeline.scene_file import names_for

    width = min(100, shutil.get_terminal_size().columns)
    lines = [
        textwrap.fill(
            ", ".join(names),
            width,
            initial_indent=f"  {key:<18}  ",
            subsequent_indent=" " * 22,
            break_on_hyphens=False,
        )
        for key in keys
        if (names := names_for(key))
    ]
    return "\n".join(["", "names:", *lines, ""]) if lines else ""


def add_verbosity(parser: argparse.ArgumentParser, default: Any) -> None:
    """Let people choose how much is said while work goes on."""
    much = parser.add_mutually_exclusive_group()
    for flags, level, words in (
        (("-v", "--verbose"), 1, "say more about what is done"),
        (("-q", "--quiet"), -1, "say nothing but errors and results"),
    ):
        much.add_argument(
            *flags,
            dest="verbosity",
            action="store_const",
            const=level,
            default=default,
            help=words,
        )


def add_request(sub: Parser) -> None:
    """Add the choices that still and render share."""
    sub.add_argument("--camera", help="a name from the scene's cameras")
    sub.add_setting("--quality", "quality")
    add_size(sub)
    sub.add_setting("--spp", "quality.spp", type=int)
    sub.add_argument(
        "--time-budget",
        type=float,
        metavar="CPU_SECONDS",
        help="what a frame may cost here; a pilot chooses the samples",
    )
    sub.add_argument(
        "--target-error",
        type=float,
        metavar="FLIP",
        help="error that a picture may have, such as 0.04; a pilot chooses the samples",
    )
    sub.add_setting("--seed", "seed", type=int)
    add_variant(sub)
    add_overrides(sub)


def add_size(sub: Parser, default: tuple[int, int] | None = None, **words: str) -> None:
    """Let the size of pictures be chosen.

    Args:
        sub: The command.
        default: Width, height [px]; None leaves it to the scene file.
        words: `before` and `after`, as for `Parser.add_setting`.
    """
    if default is not None:
        words = {"after": " [{}x{}]".format(*default), **words}
    sub.add_setting(
        "--size", "output.size", type=picture_size, default=default, metavar="WxH", **words
    )


def add_variant(sub: argparse.ArgumentParser, names: Iterable[str] = VARIANTS) -> None:
    """Let the renderer's variant be chosen.

    Args:
        sub: The command.
        names: Of the variants that it can work with.
    """
    *first, last = names
    sub.add_argument("--variant", default=VARIANT, help=f"{', '.join(first)} or {last} [{VARIANT}]")


def add_window(
    sub: argparse.ArgumentParser, *, first: str = "first time [s]", last: str = "last time [s]"
) -> None:
    """Let a stretch of time be chosen, as `start` and `end`.

    Args:
        sub: The command.
        first: What `--from` means.
        last: What `--to` means.
    """
    sub.add_argument("--from", dest="start", type=sumo_time, metavar="T", help=first)
    sub.add_argument("--to", dest="end", type=sumo_time, metavar="T", help=last)


def add_overwrite(sub: argparse.ArgumentParser, what: str = "replace what exists") -> None:
    """Let what exists be replaced; without this option nothing is overwritten."""
    sub.add_argument("--overwrite", action="store_true", help=what)


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


def sumo_time(text: str) -> float:
    """Read a time of the simulation [s]: seconds, or a clock as SUMO writes it, 16:30:00."""
    from sumo3dviz_pt.pipeline.reading import parse_time

    try:
        return parse_time(text)
    except ValueError:
        message = f"{text!r} is no time; write seconds, or a clock such as 16:30:00"
        raise argparse.ArgumentTypeError(message) from None


def frame_range(text: str) -> tuple[int, int]:
    """Read A:B."""
    first, _, after = text.partition(":")
    if not (first.isdigit() and after.isdigit()):
        raise argparse.ArgumentTypeError(f"{text!r} is no range; write it like 10:20")
    return int(first), int(after)


def overrides_of(options: argparse.Namespace) -> dict[str, str]:
    """Return what --set says: values by key.

    Raises:
        ConfigError: If a key has no value.
    """
    pairs = [item.partition("=") for item in options.set]
    for key, sign, _ in pairs:
        if not sign:
            raise ConfigError(f"{key!r} has no value; write it like quality=draft", key="--set")
    return {key.strip(): value for key, _, value in pairs}


def request_of(options: argparse.Namespace) -> Request:
    """Return what still and render ask for."""
    from sumo3dviz_pt.pipeline.production import Request

    return Request(
        options.camera,
        options.quality,
        options.size,
        options.spp,
        options.seed,
        options.variant,
        command_in(options.words),
        options.time_budget,
        options.target_error,
    )


_NOT_SEEN = {
    "-o": 1, "--output": 1, "--frames": 1, "--shot": 1, "--film": 1,
    "--resume": 0, "--overwrite": 0, "--discard-frames": 0, "--mix-devices": 0,
    "-q": 0, "--quiet": 0, "-v": 0, "--verbose": 0,
}  # fmt: skip
"""Options that no picture shows, and how many words follow them."""


def command_in(words: Sequence[str]) -> str:
    """Return a command as pictures tell it: without what only says where and how it is carried out.

    So a film has the same bytes wherever it lies and in whatever parts it was rendered. Files stand
    by their names where a path would tell of this machine: whose it is, and where things lie.
    """
    shown: list[str] = []
    skip = 0
    for word in words:
        if skip:
            skip -= 1
            continue
        follow = _unseen(word)
        if follow is None:
            shown.append(_without_places(word))
        else:
            skip = follow
    return shlex.join([PROGRAM, *shown])


_PLACE = re.compile(r"(?<![\w.:/\\])(?:[A-Za-z]:[\\/]|[\\/~]|\.\.[\\/])[^\s\"'{}\[\],]*[\\/]")
"""Folders before a file's name, from the root, from a home or upwards."""


def _without_places(word: str) -> str:
    """Return a word in which files that are named by whole paths stand by their names."""
    key, sign, value = word.partition("=")
    for before, path in (("", word), (key + sign, value)):
        if re.match(r"[A-Za-z]:[\\/]|[\\/~]|\.\.[\\/]", path):
            return before + re.split(r"[\\/]", path.rstrip("\\/"))[-1]
    return _PLACE.sub("", word)


def _unseen(word: str) -> int | None:
    """Return how many words follow an option that no picture shows; None for all other words."""
    name, sign, _ = word.partition("=")
    if name in _NOT_SEEN:
        return 0 if sign else _NOT_SEEN[name]
    if len(name) > len("--o") and "--output".startswith(name):  # abbreviated
        return 0 if sign else 1
    return 0 if word.startswith("-o") else None


def complain(error: object, code: int, hint: str = "") -> int:
    """Print an error as one sentence; return the exit code.

    Args:
        error: What went wrong.
        code: The exit code.
        hint: What to do, added to the sentence.
    """
    print(f"{PROGRAM}: {error}{hint}", file=sys.stderr)
    return code


def progress(name: str, steps: Sequence[WorkStep]) -> AbstractContextManager[None]:
    """Show how far the work within the `with` statement is, unless the command is quiet."""
    from sumo3dviz_pt.pipeline.steps import followed

    if not logging.getLogger("sumo3dviz_pt").isEnabledFor(logging.WARNING):
        return nullcontext()
    return followed(name, steps)


def cpu_in_words(seconds: float) -> str:
    """Return CPU-seconds in words."""
    return f"{seconds:.1f} CPU-seconds"
