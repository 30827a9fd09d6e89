"""The files of `deploy/monitoring`, checked with Prometheus' own tool, and against what the exporter shows."""

import json
import re
import shutil
import subprocess

import pytest

from tests.support.paths import ROOT

MONITORING = ROOT / "deploy/monitoring"
_METRIC = re.compile(r"\b(?:crcolony|process)_\w+")


def promtool(*words: str, input_: str | None = None) -> subprocess.CompletedProcess[str]:
    """Run promtool to its end; the test is skipped where it is not installed."""
    if shutil.which("promtool") is None:
        pytest.skip("promtool is not installed")
    command = ["promtool", *words]
    return subprocess.run(command, input=input_, capture_output=True, text=True, timeout=60)


def check_metrics(text: str) -> None:
    """Fail if promtool finds anything to say about an output, where it is installed."""
    if shutil.which("promtool") is not None:
        done = promtool("check", "metrics", input_=text)
        assert done.returncode == 0, done.stdout + done.stderr


def expressions_of_board() -> list[str]:
    """Return every query of the Grafana board, those of its variables too."""
    board = json.loads((MONITORING / "grafana.json").read_text("utf-8"))
    targets = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    variables = [variable["query"] for variable in board["templating"]["list"]]
    return [*targets, *variables]


def missing_names(shown: set[str]) -> set[str]:
    """Return the metrics that the board or the alerts name, and that are not shown."""
    rules = (MONITORING / "alerts.yml").read_text("utf-8")
    expressions = "\n".join(line for line in rules.splitlines() if "summary:" not in line)
    named = set(_METRIC.findall("\n".join([*expressions_of_board(), expressions])))
    assert len(named) > 20, "names are found at all"
    return named - shown
