"""Prints what is wrong with an inventory, or what runs where: `crcolony deploy check`."""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from crcolony.runtime.console import print_line
from crcolony_deploy.errors import DeployError
from crcolony_deploy.inventory import Inventory, InventoryHost, load_inventory
from crcolony_deploy.inventory_security import security_problems
from crcolony_deploy.service_plan import HostPlan, plan_host
from crcolony_deploy.wheelhouse import MANIFEST


def check_inventory(path: Path, as_json: bool) -> None:
    """Print the plan of an inventory, or a line for each problem but the last, with which it raises DeployError."""
    inventory, problems = load_inventory(path)
    problems = problems or list(security_problems(inventory))
    if problems:
        for problem in problems[:-1]:
            print_line(f"{path}: {problem}")
        count = f" ({len(problems)} problems)" if len(problems) > 1 else ""
        raise DeployError(f"{path}: {problems[-1]}{count}")
    plans = {host.name: plan_host(inventory, host) for host in inventory.hosts}
    if as_json:
        hosts = {host.name: _as_dict(inventory, host, plans[host.name]) for host in inventory.hosts}
        json.dump(hosts, sys.stdout, indent=2)
        print_line("")
        return
    for host in inventory.hosts:
        print_line(f"{host.name} ({host.address})")
        for service in plans[host.name].services:
            port = f", port {service.port}" if service.port else ""
            print_line(f"    {service.kind} {service.name}{port}")
    print_line(f"{path}: valid")


def _as_dict(inventory: Inventory, host: InventoryHost, plan: HostPlan) -> dict[str, Any]:
    """Return what a playbook has to know of a host."""
    variables = host.variables

    def local(text: str) -> str:
        return str(inventory.local_path(text)) if text else ""

    wheelhouse = inventory.local_path(variables.wheelhouse)
    return {
        "address": host.address,
        "colony": variables.colony,
        "services": [
            asdict(service)
            | {
                "unit": service.unit,
                "options_file": service.options_file,
                "environment": service.environment,
            }
            for service in plan.services
        ],
        "network": plan.network,
        "extras": list(plan.extras),
        "python": variables.python,
        "wheelhouse": str(wheelhouse),
        "manifest": _manifest_of(wheelhouse),
        "code_cache": local(variables.code_cache),
        "run": local(variables.run),
        "authority": local(variables.authority),
        "authority_at": variables.authority_at,
        "members": [asdict(member) | {"folder": member.folder} for member in plan.members],
    }


def _manifest_of(wheelhouse: Path) -> Any:
    """Return the manifest of a wheelhouse; None if there is none yet."""
    try:
        return json.loads((wheelhouse / MANIFEST).read_text("utf-8"))
    except OSError:
        return None
    except ValueError:
        raise DeployError(
            f"{wheelhouse / MANIFEST}: damaged; collect the wheelhouse again"
        ) from None
