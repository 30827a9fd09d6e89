"""`crcolony claims`: the table of all claims, measured again from the data of experiments."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK


def add_claims(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony claims`."""
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="FOLDER",
        help="results folders of experiments, complete, one of each",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="Markdown file to write; default: print it"
    )
    parser.set_defaults(command=_claims)
    add_examples(
        parser,
        ("crcolony claims runs/ability runs/taxi --out docs/claims.md", "the table of the project"),
    )


def _claims(options: argparse.Namespace) -> int:
    from crcolony.durable_files import replace_file
    from crcolony.experiments.framework.claims_table import format_table, read_table

    text = "\n".join(format_table(read_table(options.folders))) + "\n"
    if options.out is None:
        print(text, end="")
        return EXIT_OK
    try:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        replace_file(options.out, lambda file: file.write(text.encode()))
    except (OSError, ValueError) as error:  # ValueError: no system has such a path
        reason = getattr(error, "strerror", None) or error
        raise UsageError(f"--out {options.out}: cannot be written: {reason}") from None
    print(options.out)
    return EXIT_OK
