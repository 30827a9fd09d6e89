"""`crcolony compile`: compile what robots and arenas need, ahead of their first start."""

import argparse

from crcolony.commands.options import add_examples
from crcolony.errors import EXIT_OK


def add_compile(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony compile`."""
    parser.add_argument(
        "--where", action="store_true", help="only print the folder of the compiled code"
    )
    parser.set_defaults(command=_compile)
    add_examples(
        parser,
        ("crcolony compile", "takes a minute or more, once a version and processor"),
    )


def _compile(options: argparse.Namespace) -> int:
    from crcolony.runtime.compile_ahead import compile_ahead, kept_code
    from crcolony.runtime.console import print_line

    print_line(str(kept_code() if options.where else compile_ahead(print_line)))
    return EXIT_OK
