"""Peers, message rates, losses and restarts are counted from telemetry."""

import numpy as np
import pytest
from crcolony_dashboards.tabs.network import IS_PEER, ITSELF, NO_PEER, UNKNOWN, NetworkTab

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S, Fault
from tests.support.drawn import RecordingStreams, TabHarness


@pytest.fixture
def show() -> TabHarness:
    return TabHarness(NetworkTab())


def cells(streams: RecordingStreams, robots: int) -> list[list[tuple[int, ...]]]:
    """Return the colour in the middle of every cell."""
    picture = streams.picture("/network/peer_matrix")
    size = 512 // robots
    assert picture.shape == (robots * size, robots * size, 3)
    middles = size // 2 + size * np.arange(robots)
    return [[tuple(picture[y, x].tolist()) for x in middles] for y in middles]


class TestPeerMatrix:
    """Which robot (row) has which other robots (columns) as peers."""

    def test_the_matrix_has_the_peers_that_robots_published(self, show: TabHarness) -> None:
        """A robot that has not published any is unknown; colonies follow one another."""
        show.telemetry.join(0, 1, 2)
        show.telemetry.join(3, colony="red")
        show.telemetry.robot_metadata(0, 1, 2, 3)
        show.telemetry.robot_metadata(1, 0)
        assert cells(show.draw(1.0), 4) == [
            [ITSELF, IS_PEER, IS_PEER, IS_PEER],
            [IS_PEER, ITSELF, NO_PEER, NO_PEER],
            [UNKNOWN, UNKNOWN, ITSELF, UNKNOWN],
            [UNKNOWN, UNKNOWN, UNKNOWN, ITSELF],
        ]
        names = ["blue #0", "blue #1", "blue #2", "red #3"]
        assert show.streams.shown("/network/peer_matrix/names", "labels") == names + names

    def test_names_are_beside_rows_and_columns(self, show: TabHarness) -> None:
        """In the middle of each."""
        show.telemetry.join(0, 1)
        streams = show.draw(1.0)
        assert streams.shown("/network/peer_matrix/names", "labels") == ["#0", "#1", "#0", "#1"]
        where = np.array(streams.shown("/network/peer_matrix/names", "positions"))
        assert where[:2, 0].tolist() == where[2:, 1].tolist() == [128.0, 384.0]
        assert np.all(where[:2, 1] < 0.0)
        assert np.all(where[2:, 0] < 0.0)

    def test_the_matrix_is_drawn_when_it_has_changed(self, show: TabHarness) -> None:
        """And from time to time for viewers that connect late."""
        show.telemetry.join(0, 1)
        show.telemetry.robot_metadata(0, 1)
        assert show.draw(1.0).times("/network/peer_matrix") == 1
        drawn = []
        for _ in range(30):
            show.telemetry.robot_metadata(0, 1)
            drawn.append(show.draw(1.0).times("/network/peer_matrix"))
        assert drawn == ([0] * 14 + [1]) * 2
        show.telemetry.robot_metadata(0)
        assert show.draw(1.0).times("/network/peer_matrix") == 1
        assert cells(show.streams, 2)[0] == [ITSELF, NO_PEER]

    def test_without_robots_there_is_no_matrix(self, show: TabHarness) -> None:
        """It is cleared when all have left, and drawn again when one returns."""
        assert show.draw(1.0).entities("/network/peer_matrix") == []
        show.telemetry.join(0)
        show.draw(1.0)
        show.telemetry.offline(0)
        assert show.draw(1.0).entities("/network/peer_matrix") == []
        show.telemetry.join(0)
        assert cells(show.draw(1.0), 1) == [[ITSELF]]

    def test_the_size_of_the_matrix_is_limited(self, show: TabHarness) -> None:
        """Each cell has a whole number of pixels."""
        show.telemetry.join(*range(40))
        assert len(cells(show.draw(1.0), 32)) == 32


class TestPlots:
    """Numbers over time."""

    def test_rates_are_those_since_the_last_drawing(self, show: TabHarness) -> None:
        """Per second; there are none at the first one."""
        show.telemetry.join(0, 1)
        assert show.draw(1.0).scalars("/network/rates") == []
        size = show.telemetry.monitor.bytes
        for _ in range(4):
            show.telemetry.state(0, 1)
            show.telemetry.events(0, Fault(1, "x"))
            show.telemetry.scene()
        ((states, events, scenes, kilobytes),) = show.draw(2.0).scalars("/network/rates")
        assert (states, events, scenes) == (4.0, 2.0, 2.0)
        assert kilobytes == pytest.approx((show.telemetry.monitor.bytes - size) / 2_000.0)

    def test_ages_are_those_of_the_last_states(self, show: TabHarness) -> None:
        """Robots without a state are left out."""
        assert show.draw(1.0).scalars("/network/ages") == []
        for robot in range(3):
            show.telemetry.online(robot)
            show.telemetry.state(robot)
            show.telemetry.at_s += 1.0
        show.telemetry.online(3)
        (ages,) = show.draw(1.0).scalars("/network/ages")
        assert ages == pytest.approx([3.0, 3.8, 4.0])

    def test_the_robots_counters_are_added_up(self, show: TabHarness) -> None:
        """Losses and undecided matings are summed; of the numbers of peers quantiles are drawn."""
        show.telemetry.join(
            0, peers=3, dropped=1, refused=2, faults=3, waiting=4, doubts=5, orphaned=6
        )
        for robot, peers in ((1, 1), (2, 7)):
            show.telemetry.join(
                robot, peers=peers, dropped=0, refused=10, faults=0, waiting=0, doubts=0, orphaned=0
            )
        show.telemetry.handle("state", "nonsense")
        streams = show.draw(1.0)
        assert streams.scalars("/network/peers") == [[1.0, 3.0, 7.0]]
        assert streams.scalars("/network/losses") == [[0.0, 1.0, 22.0, 1.0, 3.0]]
        assert streams.scalars("/network/matings") == [[4.0, 5.0, 6.0]]

    def test_missed_events_are_counted(self, show: TabHarness) -> None:
        """Events up to a state's sequence number that were not received."""
        show.telemetry.join(0, seq=0)
        show.telemetry.state(0, seq=5)
        ((missed, *_),) = show.draw(1.0).scalars("/network/losses")
        assert missed == 5.0

    def test_robots_online_silent_and_restarted_are_counted(self, show: TabHarness) -> None:
        """Restarts in total, also of robots that are offline."""
        show.telemetry.join(0, 1)
        show.telemetry.online(1, incarnation=4)
        show.telemetry.state(1, incarnation=4)
        show.telemetry.offline(0)
        assert show.draw(1.0).scalars("/network/presence") == [[1.0, 0.0, 1.0]]
        assert show.draw(SILENT_AFTER_S).scalars("/network/presence") == [[1.0, 1.0, 1.0]]

    def test_every_series_has_a_name(self, show: TabHarness) -> None:
        """As many names as values."""
        show.telemetry.join(0)
        show.draw(1.0)
        streams = show.draw(1.0)
        for name in ("rates", "ages", "peers", "losses", "matings", "presence"):
            (values,) = streams.scalars(f"/network/{name}")
            assert len(streams.shown(f"/network/{name}", "names")) == len(values)

    def test_plots_are_drawn_once_a_second(self, show: TabHarness) -> None:
        """However often the dashboard draws."""
        show.telemetry.join(0)
        drawn = sum(show.draw(0.1).times("/network/presence") for _ in range(100))
        assert drawn == pytest.approx(10, abs=1)


class TestTable:
    """One row for every robot."""

    def rows(self, show: TabHarness) -> list[str]:
        return show.draw(1.0).text("/network/robots").splitlines()

    def test_without_robots_a_sentence_says_so(self, show: TabHarness) -> None:
        """In place of an empty table."""
        assert self.rows(show) == ["No robot is on the network yet."]

    def test_a_robot_is_online_silent_or_offline(self, show: TabHarness) -> None:
        """One without a state has an empty row."""
        show.telemetry.join(
            0,
            1,
            energy=0.25,
            generation=2,
            matings=4,
            conceptions=3,
            peers=1,
            doubts=0,
            orphaned=0,
            arena="lab",
        )
        show.telemetry.online(2)
        show.telemetry.offline(1)
        _, _, *rows = self.rows(show)
        assert rows[0] == "| #0 | online | lab | 0.25 | 2 | 4 | 3 | 1 | 0 | 1.5 s | 0 |"
        assert rows[1].startswith("| #1 | offline | ")
        assert rows[2].endswith(" | silent | | | | | | | | | |")
        show.telemetry.at_s += SILENT_AFTER_S
        assert self.rows(show)[2].startswith("| #0 | silent | ")

    def test_orphaned_matings_are_beside_those_in_doubt(self, show: TabHarness) -> None:
        """Only if there are any."""
        show.telemetry.join(0, doubts=2, orphaned=1)
        assert "| 2 (1 orphaned) |" in self.rows(show)[2]

    def test_every_row_has_all_columns(self, show: TabHarness) -> None:
        """Whatever is known of the robot."""
        show.telemetry.online(0)
        show.telemetry.join(1)
        assert len({row.count("|") for row in self.rows(show)}) == 1

    def test_rows_above_the_limit_are_counted(self, show: TabHarness) -> None:
        """In a line below the table."""
        show.telemetry.join(*range(50))
        rows = self.rows(show)
        assert len(rows) == 2 + 40 + 2
        assert rows[-1] == "… and 10 more"
