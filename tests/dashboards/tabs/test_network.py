"""Who sees whom, what is heard and what is lost: counted, not guessed."""

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


class TestSights:
    """Who sees whom: robots down the side see those along the top, or not."""

    def test_everybody_sees_whom_they_say_they_see(self, show: TabHarness) -> None:
        """Whoever was not asked yet has said nothing; colonies stand one after the other."""
        show.sample.join(0, 1, 2)
        show.sample.join(3, colony="red")
        show.sample.about(0, 1, 2, 3)
        show.sample.about(1, 0)
        assert cells(show.draw(1.0), 4) == [
            [ITSELF, IS_PEER, IS_PEER, IS_PEER],
            [IS_PEER, ITSELF, NO_PEER, NO_PEER],
            [UNKNOWN, UNKNOWN, ITSELF, UNKNOWN],
            [UNKNOWN, UNKNOWN, UNKNOWN, ITSELF],
        ]
        names = ["blue #0", "blue #1", "blue #2", "red #3"]
        assert show.streams.shown("/network/peer_matrix/names", "labels") == names + names

    def test_names_stand_beside_their_rows_and_columns(self, show: TabHarness) -> None:
        """In the middle of each."""
        show.sample.join(0, 1)
        streams = show.draw(1.0)
        assert streams.shown("/network/peer_matrix/names", "labels") == ["#0", "#1", "#0", "#1"]
        where = np.array(streams.shown("/network/peer_matrix/names", "positions"))
        assert where[:2, 0].tolist() == where[2:, 1].tolist() == [128.0, 384.0]
        assert np.all(where[:2, 1] < 0.0)
        assert np.all(where[2:, 0] < 0.0)

    def test_it_is_drawn_again_only_if_it_has_changed(self, show: TabHarness) -> None:
        """A picture is large; but who comes late gets to see it too."""
        show.sample.join(0, 1)
        show.sample.about(0, 1)
        assert show.draw(1.0).times("/network/peer_matrix") == 1
        drawn = []
        for _ in range(30):
            show.sample.about(0, 1)
            drawn.append(show.draw(1.0).times("/network/peer_matrix"))
        assert drawn == ([0] * 14 + [1]) * 2
        show.sample.about(0)
        assert show.draw(1.0).times("/network/peer_matrix") == 1
        assert cells(show.streams, 2)[0] == [ITSELF, NO_PEER]

    def test_nobody_sees_nobody(self, show: TabHarness) -> None:
        """When all have gone the picture is taken away; when one is back it is there again."""
        assert show.draw(1.0).entities("/network/peer_matrix") == []
        show.sample.join(0)
        show.draw(1.0)
        show.sample.go(0)
        assert show.draw(1.0).entities("/network/peer_matrix") == []
        show.sample.join(0)
        assert cells(show.draw(1.0), 1) == [[ITSELF]]

    def test_of_many_the_first_are_shown(self, show: TabHarness) -> None:
        """Each cell a whole number of pixels."""
        show.sample.join(*range(40))
        assert len(cells(show.draw(1.0), 32)) == 32


class TestLines:
    """Numbers over time."""

    def test_rates_are_of_what_was_heard_since(self, show: TabHarness) -> None:
        """In a second; there are none before."""
        show.sample.join(0, 1)
        assert show.draw(1.0).scalars("/network/rates") == []
        size = show.sample.monitor.bytes
        for _ in range(4):
            show.sample.state(0, 1)
            show.sample.tell(0, Fault(1, "x"))
            show.sample.scene()
        ((states, events, scenes, kilobytes),) = show.draw(2.0).scalars("/network/rates")
        assert (states, events, scenes) == (4.0, 2.0, 2.0)
        assert kilobytes == pytest.approx((show.sample.monitor.bytes - size) / 2_000.0)

    def test_ages_are_those_of_the_last_states(self, show: TabHarness) -> None:
        """Who has told none has none."""
        assert show.draw(1.0).scalars("/network/ages") == []
        for robot in range(3):
            show.sample.come(robot)
            show.sample.state(robot)
            show.sample.at_s += 1.0
        show.sample.come(3)
        (ages,) = show.draw(1.0).scalars("/network/ages")
        assert ages == pytest.approx([3.0, 3.8, 4.0])

    def test_what_robots_count_is_added_up(self, show: TabHarness) -> None:
        """Losses, and matings that hang in the air; whom they see is not added but ordered."""
        show.sample.join(
            0, peers=3, dropped=1, refused=2, faults=3, waiting=4, doubts=5, orphaned=6
        )
        for robot, peers in ((1, 1), (2, 7)):
            show.sample.join(
                robot, peers=peers, dropped=0, refused=10, faults=0, waiting=0, doubts=0, orphaned=0
            )
        show.sample.on_event("state", "nonsense")
        streams = show.draw(1.0)
        assert streams.scalars("/network/peers") == [[1.0, 3.0, 7.0]]
        assert streams.scalars("/network/losses") == [[0.0, 1.0, 22.0, 1.0, 3.0]]
        assert streams.scalars("/network/matings") == [[4.0, 5.0, 6.0]]

    def test_what_was_missed_is_counted(self, show: TabHarness) -> None:
        """Events that a state names and that have not come."""
        show.sample.join(0, seq=0)
        show.sample.state(0, seq=5)
        ((missed, *_),) = show.draw(1.0).scalars("/network/losses")
        assert missed == 5.0

    def test_who_is_there_silent_and_back_is_counted(self, show: TabHarness) -> None:
        """Restarts in all, of robots that are gone too."""
        show.sample.join(0, 1)
        show.sample.come(1, incarnation=4)
        show.sample.go(0)
        assert show.draw(1.0).scalars("/network/presence") == [[1.0, 0.0, 1.0]]
        assert show.draw(SILENT_AFTER_S).scalars("/network/presence") == [[1.0, 1.0, 1.0]]

    def test_lines_are_named_from_the_beginning(self, show: TabHarness) -> None:
        """As many names as there are lines."""
        show.sample.join(0)
        show.draw(1.0)
        streams = show.draw(1.0)
        for name in ("rates", "ages", "peers", "losses", "matings", "presence"):
            (values,) = streams.scalars(f"/network/{name}")
            assert len(streams.shown(f"/network/{name}", "names")) == len(values)

    def test_it_is_drawn_once_a_second(self, show: TabHarness) -> None:
        """However often the dashboard draws."""
        show.sample.join(0)
        drawn = sum(show.draw(0.1).times("/network/presence") for _ in range(100))
        assert drawn == pytest.approx(10, abs=1)


class TestTable:
    """One line for every robot."""

    def rows(self, show: TabHarness) -> list[str]:
        return show.draw(1.0).text("/network/robots").splitlines()

    def test_nobody_is_said(self, show: TabHarness) -> None:
        """In place of an empty table."""
        assert self.rows(show) == ["No robot is on the network yet."]

    def test_a_robot_is_alive_silent_or_gone(self, show: TabHarness) -> None:
        """And one that has said nothing yet is only there."""
        show.sample.join(
            0, 1, energy=0.25, generation=2, matings=4, conceptions=3, peers=1, doubts=0, orphaned=0
        )
        show.sample.come(2)
        show.sample.go(1)
        _, _, *rows = self.rows(show)
        assert rows[0] == "| #0 | online | 0.25 | 2 | 4 | 3 | 1 | 0 | 1.5 s | 0 |"
        assert rows[1].startswith("| #1 | offline | ")
        assert rows[2].endswith(" | silent | | | | | | | | |")
        show.sample.at_s += SILENT_AFTER_S
        assert self.rows(show)[2].startswith("| #0 | silent | ")

    def test_orphans_are_named_among_the_doubts(self, show: TabHarness) -> None:
        """Only where there are any."""
        show.sample.join(0, doubts=2, orphaned=1)
        assert "| 2 (1 orphaned) |" in self.rows(show)[2]

    def test_every_row_has_all_columns(self, show: TabHarness) -> None:
        """Whatever is known of the robot."""
        show.sample.come(0)
        show.sample.join(1)
        assert len({row.count("|") for row in self.rows(show)}) == 1

    def test_of_many_the_others_are_counted(self, show: TabHarness) -> None:
        """A table of thousands is read by nobody."""
        show.sample.join(*range(50))
        rows = self.rows(show)
        assert len(rows) == 2 + 40 + 2
        assert rows[-1] == "… and 10 more"
