"""What keeps a dashboard from being shown is reported in one line."""

import socket
import sys
from importlib.metadata import PackageNotFoundError

import pytest
from crcolony_dashboards import preconditions
from crcolony_dashboards.preconditions import DashboardError, check_port_is_free, check_rerun


class TestPort:
    """A port that is taken is named, with the option that chooses another one."""

    def test_a_port_that_is_taken_is_reported_with_its_option(self) -> None:
        """With the option of the port in question."""
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            with pytest.raises(DashboardError, match=r"choose another with --web-port$"):
                check_port_is_free(other.getsockname()[1], "--web-port")


class TestRerun:
    """The dashboard needs one version of Rerun."""

    def test_the_installed_version_is_accepted(self) -> None:
        """Nothing is raised."""
        check_rerun()

    def test_if_it_is_missing_the_message_says_what_to_install(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """In one line."""

        def missing(name: str) -> str:
            raise PackageNotFoundError(name)

        monkeypatch.setattr(preconditions, "version", missing)
        with pytest.raises(DashboardError) as refusal:
            check_rerun()
        assert str(refusal.value) == (
            "the dashboard needs Rerun, which is not installed: pip install 'crcolony[viz]'"
        )

    @pytest.mark.parametrize("other", ["0.40.2", "0.42.0a1", "1.41.0", "0.4.1"])
    def test_another_version_is_refused(self, monkeypatch: pytest.MonkeyPatch, other: str) -> None:
        """The message names the found and the required version."""
        monkeypatch.setattr(preconditions, "version", lambda name: other)
        with pytest.raises(DashboardError) as refusal:
            check_rerun()
        assert str(refusal.value) == (
            f"the dashboard needs Rerun 0.41, but {other} is installed: pip install 'crcolony[viz]'"
        )

    def test_a_version_that_cannot_be_imported_is_refused(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The message has the reason."""
        monkeypatch.setitem(sys.modules, "rerun", None)
        with pytest.raises(DashboardError, match=r"^Rerun 0\.41\.\d+ does not load: "):
            check_rerun()
