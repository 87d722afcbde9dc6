"""`host completion`: the script with which a shell completes verbs, options, names and files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from host.errors import ExitCode, UsageError
from host.extras import install_hint

SHELLS = ("bash", "zsh", "fish", "tcsh", "powershell")
_WHERE = """\
bash: host completion bash > ~/.local/share/bash-completion/completions/host
zsh:  host completion zsh > a folder of $fpath/_host
fish: host completion fish > ~/.config/fish/completions/host.fish
PowerShell: host completion powershell >> $PROFILE
"""
# What the names of an option are, besides files: option or positional -> kind of name.
NAMED = {
    "aircraft": "aircraft", "card": "card", "method": "method", "model": "model",
    "map": "map",
}  # fmt: skip
_FOLDERS = ("plots",)


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "completion",
        help="print the script that completes these words in your shell",
        description="Print the script with which a shell completes verbs, options, cards,"
        " aircraft, methods, models and files.",
        epilog=_WHERE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=SHELLS)


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    try:
        import shtab
    except ImportError:
        raise UsageError(f"completion needs shtab: {install_hint('shtab')}") from None
    from host.cli import command_parser, parser_of, verbs

    parser, _ = command_parser(list(verbs()))
    known = known_names()
    own: dict[str, list[str]] = {"bash": [], "zsh": []}
    for kind, names in known.items():
        words = " ".join(names)
        own["bash"].append(f'_host_{kind}() {{ compgen -W "{words}" -- $1; compgen -f -- $1; }}')
        own["zsh"].append(
            f"_host_{kind}() {{ _alternative 'names:name:({words})' 'files:file:_files'; }}"
        )
    for verb in verbs():
        for action in parser_of(parser, verb)._actions:
            _complete(action, known, shtab)
    preamble = {shell: "\n".join(lines) for shell, lines in own.items()}
    write: Any = shtab.complete  # its types leave out what its documentation allows
    print(write(parser, args.shell, preamble=preamble))
    return int(ExitCode.OK)


def known_names() -> dict[str, list[str]]:
    """Return the names that come with the package, by kind."""
    from host.aircraft.file import names as aircraft
    from host.readers.shipped_maps import shipped_maps
    from host.sysid.linear import AXIS_OF
    from host.sysid.models.named_models import shipped_files
    from host.sysid.pipeline.requested_models import COEFFICIENTS, known_methods
    from host.twin.testcard.cards import names as cards

    return {
        "aircraft": aircraft(),
        "card": cards(),
        "method": [*known_methods(), "list"],
        "model": [*AXIS_OF, COEFFICIENTS, *shipped_files(), "list"],
        "map": [*shipped_maps(), "list"],
    }


def _complete(action: Any, known: dict[str, list[str]], shtab: Any) -> None:
    """Say how an argument is completed: names and files, folders, files."""
    kind = NAMED.get(action.dest)
    if kind is not None and not (kind == "model" and not action.option_strings):
        action.complete = {"bash": f"_host_{kind}", "zsh": f"_host_{kind}"} | dict.fromkeys(
            ("fish", "powershell"), " ".join(known[kind])
        )
    elif action.dest in _FOLDERS:
        action.complete = shtab.DIRECTORY
    elif action.type is Path or action.dest == "_files":
        action.complete = shtab.FILE
