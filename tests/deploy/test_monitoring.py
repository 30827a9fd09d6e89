"""The rules and the board for Prometheus and Grafana are accepted by their tools, and each alert fires on its fault."""

import re

from tests.support.monitoring import MONITORING, expressions_of_board, promtool
from tests.support.paths import ROOT


def test_promtool_accepts_the_rules_and_the_config() -> None:
    """As a Prometheus server would."""
    for words in (("rules", "alerts.yml"), ("config", "prometheus.yml")):
        done = promtool("check", words[0], str(MONITORING / words[1]))
        assert done.returncode == 0, done.stdout + done.stderr


def test_each_alert_fires_on_its_fault_and_none_on_a_colony_that_is_well() -> None:
    """The series of the faults, and of three hours of a sound colony, are in the file of its tests."""
    done = promtool("test", "rules", str(ROOT / "tests/deploy/alerts_test.yml"))
    assert done.returncode == 0, done.stdout + done.stderr


def test_no_alert_is_without_a_test() -> None:
    """Nor without a line about what to do."""
    alerts = re.findall(r"alert: (\w+)", (MONITORING / "alerts.yml").read_text("utf-8"))
    assert len(alerts) > 10
    tests = (ROOT / "tests/deploy/alerts_test.yml").read_text("utf-8")
    page = (ROOT / "docs/operate.md").read_text("utf-8")
    assert [name for name in alerts if f"alertname: {name}\n        exp_alerts" not in tests] == []
    assert [name for name in alerts if f"`{name}`" not in page] == []


def test_the_queries_of_the_board_are_queries() -> None:
    """promtool parses each one, as the expression of a rule."""
    rules = "groups: [{name: board, rules: [%s]}]"
    each = []
    for number, expression in enumerate(expressions_of_board()):
        if expression.startswith(("label_values", "prometheus")):
            continue
        each.append(f"{{record: 'q{number}', expr: '{expression}'}}")
    done = promtool("check", "rules", "/dev/stdin", input_=rules % ", ".join(each))
    assert done.returncode == 0, done.stdout + done.stderr
