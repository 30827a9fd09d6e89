"""What is wrong with how the hosts of an inventory prove who they are."""

import os
import re
from collections.abc import Iterator

from crcolony.errors import CrcolonyError
from crcolony_deploy.authority import Authority, check_member_name
from crcolony_deploy.inventory import Inventory
from crcolony_deploy.service_plan import OPEN_NETWORK, plan_host


def security_problems(inventory: Inventory) -> Iterator[str]:
    """Yield what is wrong with the authority of an inventory, or with its absence."""
    authorities = {host.variables.authority for host in inventory.hosts}
    if len(authorities) > 1:
        yield "crcolony_authority: some hosts have another one: a colony has one authority"
    elif "" in authorities:
        yield from _openness_problems(inventory)
    else:
        yield from _authority_problems(inventory, authorities.pop())


def _openness_problems(inventory: Inventory) -> Iterator[str]:
    missing = [host.name for host in inventory.hosts if not host.variables.open_network]
    if missing:
        yield (
            "without crcolony_authority anybody on the network may steer every body: make one"
            " (crcolony authority create), or set crcolony_open_network: true"
        )
    elif os.environ.get(OPEN_NETWORK) != "yes":
        yield f"crcolony_open_network also needs {OPEN_NETWORK}=yes in the environment"


def _authority_problems(inventory: Inventory, folder: str) -> Iterator[str]:
    try:
        authority = Authority.load(inventory.local_path(folder))
    except CrcolonyError as error:
        yield f"crcolony_authority: {error}"
        return
    for host in inventory.hosts:
        variables, colony = host.variables, authority.settings.colony
        if variables.colony != colony:
            yield f"host {host.name}: the authority is of colony {colony}, not {variables.colony}"
        if variables.authority_at and not re.fullmatch(r"\S+:\d{1,5}", variables.authority_at):
            yield f"host {host.name}: crcolony_authority_at: expected HOST:PORT"
        for member in plan_host(inventory, host).members:
            try:
                check_member_name(member.name)
            except CrcolonyError as error:
                yield f"host {host.name}: {error}"
