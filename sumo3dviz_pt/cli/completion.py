"""`completion`: writes a script that lets a shell complete commands, options and names."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from sumo3dviz_pt.cli.options import PROGRAM


@dataclass(frozen=True, slots=True)
class _Word:
    """An option or an argument.

    Attributes:
        flags: As written; empty for arguments without an option.
        help: What it means.
        takes: What may follow; None means a file, empty nothing.
    """

    flags: tuple[str, ...]
    help: str
    takes: tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class _Command:
    """A command.

    Attributes:
        about: What it does.
        words: Its options and arguments.
    """

    about: str
    words: tuple[_Word, ...]

    @property
    def offered(self) -> list[str]:
        """What can stand after it."""
        return [each for word in self.words for each in _offered(word)]


_Commands = Mapping[str, _Command]
"""Commands by name."""


def add(commands: Any) -> None:
    """Say what it takes."""
    sub = commands.add_parser(
        "completion", help="a script by which your shell completes commands and names"
    )
    sub.add_argument("shell", choices=tuple(_SHELLS), help=", ".join(_SHELLS))
    sub.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Print the script."""
    print(_SHELLS[options.shell](_commands(options.parser)))
    return 0


def _commands(parser: argparse.ArgumentParser) -> _Commands:
    """Return every command's meaning and words."""
    subs = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    about = {action.dest: action.help or "" for action in subs._choices_actions}
    return {
        name: _Command(about[name], tuple(_word(each, sub.settings) for each in sub._actions))
        for name, sub in subs.choices.items()
    }


def _word(action: argparse.Action, settings: Mapping[str, str]) -> _Word:
    """Return what a shell needs to know of an option; `settings` are a parser's."""
    from sumo3dviz_pt.pipeline.choices import names_for

    flags, meaning = tuple(action.option_strings), (action.help or "").replace("%%", "%")
    if action.choices is not None:
        return _Word(flags, meaning, tuple(map(str, action.choices)))
    names = [name for flag in flags if flag in settings for name in names_for(settings[flag])]
    if names:
        return _Word(flags, meaning, tuple(names))
    return _Word(flags, meaning, () if action.nargs == 0 else None)


def _bash(commands: _Commands) -> str:
    """Write the script for bash; zsh understands it, too."""
    cases = []
    for name, command in commands.items():
        flags = " ".join(flag for word in command.words for flag in word.flags)
        arguments = (word for word in command.words if not word.flags)
        given = " ".join(each for word in arguments for each in word.takes or ())
        cases.append(f'    {name}) words="{flags} {given}" ;;')
    values = [
        f'    {"|".join(word.flags)}) words="{" ".join(word.takes or ())}" ;;'
        for word in _taking(commands)
    ]
    return "\n".join(
        [
            f"# bash completion for {PROGRAM}; load it by: source FILE",
            "_sumo3dviz_pt() {",
            '  local here="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}"',
            '  local words="" command="" word',
            '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do',
            '    case "$word" in -*) ;; *) command="$word"; break ;; esac',
            "  done",
            '  case "$command" in',
            f'    "") words="{" ".join(commands)} --help --version --verbose --quiet" ;;',
            *cases,
            "  esac",
            '  case "$before" in',
            *values,
            "  esac",
            '  COMPREPLY=($(compgen -W "$words" -- "$here"))',
            "}",
            f"complete -o default -F _sumo3dviz_pt {PROGRAM}",
        ]
    )


def _taking(commands: _Commands) -> Iterator[_Word]:
    """Yield the options with values, each once; those that take files have none to offer."""
    seen = set[tuple[str, ...]]()
    for command in commands.values():
        for word in command.words:
            if word.flags and word.takes != () and word.flags not in seen:
                seen.add(word.flags)
                yield word


def _zsh(commands: _Commands) -> str:
    """Write the script for zsh, through its emulation of bash."""
    load = "autoload -U +X compinit bashcompinit && compinit && bashcompinit"
    return f"# zsh completion for {PROGRAM}; load it by: source FILE\n{load}\n{_bash(commands)}"


def _fish(commands: _Commands) -> str:
    """Write the script for fish."""
    lines = [f"# fish completion for {PROGRAM}; put it into ~/.config/fish/completions"]
    for name, command in commands.items():
        start = f"complete -c {PROGRAM} -n"
        lines.append(f"{start} __fish_use_subcommand -f -a {name} -d {_quoted(command.about)}")
        within = f"{start} '__fish_seen_subcommand_from {name}'"
        lines += [" ".join([within, *_fish_word(word)]) for word in command.words if _offered(word)]
    return "\n".join(lines)


def _fish_word(word: _Word) -> Iterator[str]:
    """Yield the parts of an option's line for fish."""
    for flag in word.flags:
        yield f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}"
    if word.takes:
        yield f"-x -a {_quoted(' '.join(word.takes))}"
    elif word.takes is None and word.flags:
        yield "-r -F"
    yield f"-d {_quoted(word.help)}"


def _powershell(commands: _Commands) -> str:
    """Write the script for PowerShell, also on Windows."""
    table = [
        f"  {_quoted(name)} = @({', '.join(map(_quoted, command.offered))})"
        for name, command in commands.items()
    ]
    values = [
        f"  {_quoted(flag)} = @({', '.join(map(_quoted, word.takes))})"
        for word in _taking(commands)
        if word.takes
        for flag in word.flags
    ]
    return "\n".join(
        [
            f"# PowerShell completion for {PROGRAM}; load it from $PROFILE by: . FILE",
            "$sumo3dvizCommands = @{",
            *table,
            "}",
            "$sumo3dvizValues = @{",
            *values,
            "}",
            f"Register-ArgumentCompleter -Native -CommandName {PROGRAM} -ScriptBlock {{",
            "  param($word, $ast, $cursor)",
            "  $before = @($ast.CommandElements | ForEach-Object { $_.ToString() } |",
            "    Select-Object -Skip 1 | Where-Object { $_ -ne $word })",
            "  $command = $before | Where-Object { $_ -notlike '-*' } | Select-Object -First 1",
            "  $last = $before | Select-Object -Last 1",
            "  if ($last -and $sumo3dvizValues[$last]) { $words = $sumo3dvizValues[$last] }",
            "  elseif ($command) { $words = $sumo3dvizCommands[$command] }",
            "  else { $words = $sumo3dvizCommands.Keys }",
            '  $words | Where-Object { $_ -like "$word*" } | Sort-Object |',
            "    ForEach-Object { [System.Management.Automation.CompletionResult]::new($_) }",
            "}",
        ]
    )


def _offered(word: _Word) -> tuple[str, ...]:
    """Return what can stand where a command's words stand."""
    return word.flags or word.takes or ()


def _quoted(text: str) -> str:
    """Return a word in single quotes, as fish and PowerShell read them."""
    return "'" + text.replace("'", "’") + "'"


_SHELLS = {"bash": _bash, "zsh": _zsh, "fish": _fish, "powershell": _powershell}
