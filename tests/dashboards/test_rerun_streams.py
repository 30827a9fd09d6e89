"""What is logged is in all streams; viewers of this machine connect to one port."""

import socket

import pytest
import rerun as rr
import rerun.blueprint as rrb
from crcolony_dashboards.preconditions import DashboardError, check_port_is_free
from crcolony_dashboards.rerun_streams import Moment, RerunStreams, open_live

from crcolony.transport.zenoh_session import free_port
from tests.support.fake_telemetry import T


def blueprint() -> rrb.Blueprint:
    return rrb.Blueprint(rrb.TextLogView(origin="/log"))


class TestLive:
    """Viewers of this machine connect to one port."""

    def test_a_port_that_is_taken_is_refused(self) -> None:
        """The message names the option that chooses another; the port is left as it was."""
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            port = other.getsockname()[1]
            line = f"127.0.0.1:{port}: address already in use; choose another with --port"
            with pytest.raises(DashboardError) as refusal:
                open_live(port, "run", blueprint())
            assert str(refusal.value) == line
        check_port_is_free(port, "--port")

    def test_viewers_connect_to_its_port(self) -> None:
        """Without viewers it logs all the same, and closing waits for none."""
        port = free_port()
        live, url = open_live(port, "run", blueprint())
        assert url == f"rerun+http://127.0.0.1:{port}/proxy"
        with socket.create_connection(("127.0.0.1", port), timeout=5.0):
            pass
        streams = RerunStreams(live, None)
        for k in range(100):
            streams.set_time(Moment(T + k, 0.0, 0))
            streams.log("/a", rr.TextLog("x"))
        streams.close()
