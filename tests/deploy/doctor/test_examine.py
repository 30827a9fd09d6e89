"""All checks are made in order, and their findings printed, a line each, or as JSON."""

import json
from pathlib import Path

from crcolony_deploy.doctor.examine import CHECKS, examine, has_problem, print_findings
from crcolony_deploy.doctor.finding import ok, problem

from tests.support.examined_hosts import host_of


def test_every_check_can_be_made_of_a_host_without_anything(tmp_path: Path) -> None:
    """None fails, each finding has the name of its check, and what is not well has a remedy."""
    findings = examine(host_of(tmp_path), list(CHECKS))
    assert {finding.check for finding in findings} <= set(CHECKS)
    assert all(finding.remedy for finding in findings if finding.level != "ok")
    assert not has_problem(findings)


def test_findings_are_lines_with_the_remedy() -> None:
    """Or JSON, for programs."""
    printed = list[str]()
    findings = [ok("all well"), problem("it is full", "empty it")]
    print_findings(findings, False, printed.append)
    assert printed == ["ok      : all well", "PROBLEM : it is full; empty it"]
    printed.clear()
    print_findings(findings, True, printed.append)
    assert json.loads(printed[0])[1]["remedy"] == "empty it"
    assert has_problem(findings)
