"""What keeps a dashboard from being shown is reported in one line."""

import socket
import sys
from importlib.metadata import PackageNotFoundError

import pytest
from crcolony_dashboards import preconditions
from crcolony_dashboards.preconditions import DashboardError, check_port_is_free, check_rerun


class TestPort:
    """A port that is taken is named, with the option that chooses another one."""

    def test_the_web_viewers_port_has_an_option_of_its_own(self) -> None:
        """It is named in the line."""
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            with pytest.raises(DashboardError, match=r"choose another with --web-port$"):
                check_port_is_free(other.getsockname()[1], "--web-port")


class TestRerun:
    """The dashboard needs one version of Rerun, and says so."""

    def test_the_one_that_is_here_is_the_one_that_is_wanted(self) -> None:
        """Nothing is said then."""
        check_rerun()

    def test_without_it_a_line_says_what_to_install(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """And nothing else is needed to read it."""

        def missing(name: str) -> str:
            raise PackageNotFoundError(name)

        monkeypatch.setattr(preconditions, "version", missing)
        with pytest.raises(DashboardError) as refusal:
            check_rerun()
        assert str(refusal.value) == (
            "the dashboard needs Rerun, which is not installed: pip install 'crcolony[viz]'"
        )

    @pytest.mark.parametrize("other", ["0.40.2", "0.42.0a1", "1.41.0", "0.4.1"])
    def test_another_version_is_named(self, monkeypatch: pytest.MonkeyPatch, other: str) -> None:
        """With the one that is wanted."""
        monkeypatch.setattr(preconditions, "version", lambda name: other)
        with pytest.raises(DashboardError) as refusal:
            check_rerun()
        assert str(refusal.value) == (
            f"the dashboard needs Rerun 0.41, but {other} is installed: pip install 'crcolony[viz]'"
        )

    def test_one_that_does_not_load_is_said_to_be(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """With the reason."""
        monkeypatch.setitem(sys.modules, "rerun", None)
        with pytest.raises(DashboardError, match=r"^Rerun 0\.41\.\d+ does not load: "):
            check_rerun()
