"""Claims are written down before an experiment runs, in a file that is read strictly."""

from pathlib import Path

import pytest

from crcolony.experiments.framework.registration import parse_registration, read_registration
from crcolony.storage.files import FolderError
from tests.support.fake_experiment import REGISTRATION


def test_a_registration_has_claims_with_thresholds() -> None:
    """And knows whether these need several runs."""
    found = parse_registration(REGISTRATION)
    (claim,) = found.claims
    assert (claim.id, claim.threshold, claim.seeds, found.seeds) == ("larger", 0.5, 4, 4)
    assert found.has_statistics
    exact = REGISTRATION.replace("seeds = 4", "seeds = 1")
    assert not parse_registration(exact).has_statistics


@pytest.mark.parametrize(
    "wrong",
    [
        REGISTRATION.replace('test = "Above the threshold"', ""),
        REGISTRATION.replace("threshold = 0.5", "treshold = 0.5"),
        REGISTRATION.replace("seeds = 4", "seeds = 0"),
        REGISTRATION + REGISTRATION[REGISTRATION.index("[[claim]]") :],
        "[[claim",
    ],
)
def test_a_wrong_registration_is_refused(tmp_path: Path, wrong: str) -> None:
    """Nothing may be missing, misspelt, or there twice; the line names the file."""
    (tmp_path / "claims.toml").write_text(wrong)
    with pytest.raises(FolderError, match=r"claims\.toml: corrupt: "):
        read_registration(tmp_path / "claims.toml")


def test_a_missing_registration_is_named(tmp_path: Path) -> None:
    """As the file that it should be."""
    with pytest.raises(FolderError, match=r"claims\.toml: cannot be read: No such file"):
        read_registration(tmp_path / "claims.toml")
