"""`crcolony metrics` of real processes: printed once, and scraped over HTTP as Prometheus does."""

import urllib.request
from pathlib import Path

from prometheus_client.openmetrics.parser import text_string_to_metric_families

from tests.support.command_line import run_command
from tests.support.monitoring import check_metrics, missing_names
from tests.support.process_colony import colony, wait_until


def values(text: str) -> dict[str, dict[str, float]]:
    """Return the values of every metric of robots, by name and robot."""
    found: dict[str, dict[str, float]] = {}
    for family in text_string_to_metric_families(text):  # type: ignore[no-untyped-call]
        for sample in family.samples:
            found.setdefault(sample.name, {})[sample.labels.get("robot", "")] = sample.value
    return found


def scrape(url: str, accept: str = "application/openmetrics-text; version=1.0.0") -> str:
    """Return what is served, in the form that the client asks for."""
    request = urllib.request.Request(url, headers={"Accept": accept})
    with urllib.request.urlopen(request, timeout=10.0) as reply:
        text: str = reply.read().decode()
        return text


def test_a_colony_is_scraped_while_it_lives(tmp_path: Path) -> None:
    """Its matings grow, a robot that is killed is offline, and the board and the alerts name what is there."""
    with colony(tmp_path) as made:
        made.arena(2)
        killed, other = made.robot(), made.robot()
        options = ("--serve", "127.0.0.1:0", "--connect", made.endpoint)
        exporter = made.start("metrics", "metrics", *options)
        exporter.wait_for("/metrics\n")
        url = exporter.output.split()[-1]
        one, two = killed.id.hex()[:8], other.id.hex()[:8]

        def have_mated() -> bool:
            matings = values(scrape(url)).get("crcolony_robot_matings_total", {})
            return all(matings.get(robot, 0.0) > 2.0 for robot in (one, two))

        wait_until(have_mated, "both have mated, as the metrics say")
        now = values(scrape(url))
        assert now["crcolony_robot_online"] == {one: 1.0, two: 1.0}
        assert now["crcolony_robot_has_body"] == {one: 1.0, two: 1.0}
        assert 0.0 < now["crcolony_robot_control_period_seconds"][one] < 5.0
        assert now["crcolony_arena_online"][""] == 1.0
        assert now["process_resident_memory_bytes"][""] > 1e6
        assert missing_names(set(now)) == set()
        check_metrics(scrape(url, accept="text/plain"))
        once = run_command("metrics", "--connect", made.endpoint)
        assert once.stdout.endswith("# EOF\n"), once.stderr
        assert set(values(once.stdout)["crcolony_robot_online"]) == {one, two}
        killed.kill()
        wait_until(
            lambda: values(scrape(url))["crcolony_robot_online"] == {one: 0.0, two: 1.0},
            "the robot that was killed is offline",
        )
        exporter.stop()
