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
    parser.add_argument(
        "--short",
        type=Path,
        metavar="PAGE",
        help="Markdown page between whose marks the short form is put, too",
    )
    parser.set_defaults(command=_claims)
    add_examples(
        parser,
        ("crcolony claims runs/ability runs/taxi --out docs/claims.md", "the table of the project"),
    )


def _claims(options: argparse.Namespace) -> int:
    from crcolony.experiments.framework.claims_summary import SummaryError, with_summary
    from crcolony.experiments.framework.claims_table import format_table, read_table

    rows = read_table(options.folders)
    pages = {options.out: "\n".join(format_table(rows)) + "\n"}
    if options.short is not None:
        try:
            pages[options.short] = with_summary(options.short.read_text("utf-8"), rows)
        except (OSError, ValueError, SummaryError) as error:
            raise UsageError(f"--short {options.short}: {_reason(error)}") from None
    for page, text in pages.items():
        if page is None:
            print(text, end="")
        else:
            _write(page, text)
    return EXIT_OK


def _write(page: Path, text: str) -> None:
    from crcolony.durable_files import replace_file

    try:
        page.parent.mkdir(parents=True, exist_ok=True)
        replace_file(page, lambda file: file.write(text.encode()))
    except (OSError, ValueError) as error:  # ValueError: no system has such a path
        raise UsageError(f"{page}: cannot be written: {_reason(error)}") from None
    print(page)


def _reason(error: Exception) -> object:
    return getattr(error, "strerror", None) or error
