"""`crcolony completion`: print what makes a shell complete commands, options and settings."""

import argparse

from crcolony.commands.options import add_examples
from crcolony.errors import EXIT_OK


def add_completion(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony completion`."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell in use")
    parser.set_defaults(command=_completion)
    add_examples(
        parser,
        ("crcolony completion bash >> ~/.bashrc", "in every shell that is opened from now on"),
        ("crcolony completion fish > ~/.config/fish/completions/crcolony.fish", "for fish"),
    )


def _completion(options: argparse.Namespace) -> int:
    from argcomplete.shell_integration import shellcode

    print(shellcode(["crcolony"], shell=options.shell))
    return EXIT_OK
