"""`docs/claims.md` and its short form in README are what the published data give, of the claims as registered."""

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.claims_summary import with_summary
from crcolony.experiments.framework.claims_table import format_table, read_table
from crcolony.experiments.framework.experiment_folder import ExperimentFolder
from tests.support.paths import ROOT

DATA = sorted(path for path in (ROOT / "docs" / "data").iterdir() if path.is_dir())


def test_the_published_table_is_made_of_the_published_data() -> None:
    """By `crcolony claims docs/data/* --out docs/claims.md --short README.md`, from the rows alone."""
    rows = read_table(DATA)
    text = "\n".join(format_table(rows)) + "\n"
    assert text == (ROOT / "docs" / "claims.md").read_text("utf-8")
    readme = (ROOT / "README.md").read_text("utf-8")
    assert with_summary(readme, rows) == readme


def test_published_data_are_of_the_claims_that_are_registered() -> None:
    """What was tried of those that do not reproduce may be written afterwards; nothing else changes."""
    for path in DATA:
        published = ExperimentFolder(path).registration()
        registered = summaries()[path.name]
        for one, other in zip(published.claims, registered.claims, strict=True):
            assert {**_parts(one), "tried": ""} == {**_parts(other), "tried": ""}


def _parts(claim: object) -> dict[str, object]:
    return {name: getattr(claim, name) for name in claim.__struct_fields__}  # type: ignore[attr-defined]
