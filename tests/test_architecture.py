"""The code keeps its order: rooms as drawn, short files and functions, a test file for every module, true documents."""

import ast
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

import draw_rooms
import pytest

from tests.support.paths import ROOT

MAX_FILE_LINES = 300
MAX_FUNCTION_LINES = 60

PRODUCT = (
    ROOT / "crcolony",
    ROOT / "dashboards/crcolony_dashboards",
    ROOT / "deploy/crcolony_deploy",
    ROOT / "robot_firmware_bridge/crcolony_bridge",
)
TESTS = {
    "crcolony": ROOT / "tests/crcolony",
    "crcolony_bridge": ROOT / "tests/robot_firmware_bridge",
    "crcolony_dashboards": ROOT / "tests/dashboards",
    "crcolony_deploy": ROOT / "tests/deploy",
}
DOCUMENTS = [
    *ROOT.glob("*.md"),
    *ROOT.glob("docs/*.md"),
    *ROOT.glob("dashboards/*.md"),
    *ROOT.glob("deploy/*.md"),
    *ROOT.glob("robot_firmware_bridge/*.md"),
]

TESTED_ELSEWHERE: dict[str, str] = {
    # Values without logic: what they mean shows where they are used.
    "crcolony/body/settings.py": "crcolony/test_config.py: settings are values, read and checked there",
    "crcolony/robot/settings.py": "crcolony/test_config.py: settings are values, read and checked there",
    "crcolony/world/settings.py": "crcolony/test_config.py: settings are values, read and checked there",
    "crcolony/errors.py": "crcolony/test_cli.py: how the command line ends with each family of errors",
    "crcolony/nodes/node_inputs.py": "crcolony/nodes/test_robot_node.py: values that a node is made of",
    "crcolony/protocol/encounters.py": "crcolony/protocol/test_mating.py: the values that matings are made of",
    "crcolony/telemetry/status_changes.py": "crcolony/telemetry/test_colony_monitor.py: values it returns",
    "crcolony/transport/interface.py": "crcolony/transport/test_inbox.py: the events that it carries",
    "crcolony/demo/run_demo.py": "system/test_demo.py: both parts, with real processes",
    # Parts of the mating state machine, which is explored as a whole.
    "crcolony/protocol/recent_contacts.py": "crcolony/protocol/test_mating.py: contacts and their time",
    "crcolony/protocol/responder_marks.py": "crcolony/protocol/test_mating_recovery.py: stale proposals",
    "crcolony/storage/backup_manifest.py": "crcolony/storage/test_restore.py: lists that are damaged, or forged",
    # A test itself, run against the simulated body.
    "crcolony/body/contract_test.py": "crcolony/world/test_body_contract.py: it is a test, run there",
    "crcolony/experiments/pools/finished_jobs.py": "crcolony/experiments/colonies/test_sweep.py: with colonies",
    "crcolony/experiments/pools/worker_pool.py": "crcolony/experiments/pools/test_process_pool.py: values alone",
    # The parts of a simulated colony, which must break each promise when they are told to.
    **dict.fromkeys(
        (
            "crcolony/fault_simulation/fault_injector.py",
            "crcolony/fault_simulation/faults.py",
            "crcolony/fault_simulation/final_audit.py",
            "crcolony/fault_simulation/invariants.py",
            "crcolony/fault_simulation/simulated_arena.py",
            "crcolony/fault_simulation/simulated_network.py",
            "crcolony/fault_simulation/simulated_robot.py",
            "crcolony/fault_simulation/simulated_store.py",
        ),
        "crcolony/fault_simulation/test_simulate.py: whole colonies, and sabotages that must be found",
    ),
    # Loops and entry points of processes: real processes show what they do.
    "crcolony/runtime/arena_process.py": "system/test_kill.py: real arenas, killed and restarted",
    "crcolony/runtime/hosted_robots.py": "crcolony/runtime/test_host_process.py: the robots of a host",
    "crcolony/runtime/launch.py": "system/test_kill.py: a launch whose processes are killed",
    "crcolony/runtime/networked_arena.py": "crcolony/runtime/test_host_process.py: the arena of a host",
    "crcolony/runtime/robot_process.py": "system/test_kill.py: real robots, killed and restarted",
    "crcolony/runtime/start_arena.py": "system/test_networks.py: arenas and routers of every network",
    "crcolony/runtime/start_host.py": "system/test_networks.py: a host among other processes",
    "crcolony/runtime/start_robot.py": "system/test_networks.py: robots of every network",
    # Bodies and the emergency stop, of which both ends are tested together.
    "crcolony/body_server/body_slots.py": "crcolony/nodes/test_arena_node.py: an arena's bodies follow its rules",
    "crcolony/protocol/stop_messages.py": "crcolony/runtime/test_stop_server.py: what is answered",
    "crcolony/runtime/emergency_stop.py": "system/test_bridge.py: real robots are stopped and released",
    "crcolony/transport/zenoh_relay.py": "system/test_bridge.py: matings by infrared alone",
    "crcolony/transport/zenoh_stop.py": "system/test_bridge.py: real robots are stopped and released",
    # Deployments: both ends of an enrollment, and what an operator's command does to a running colony.
    "crcolony/commands/deployment_options.py": "crcolony/commands/test_enroll.py: addresses and roles as typed",
    "crcolony_deploy/enrollment_client.py": "deploy/test_enrollment.py: members and impostors on the network",
    "crcolony_deploy/enrollment_service.py": "deploy/test_enrollment.py: members and impostors on the network",
    "crcolony_deploy/roster_push.py": "system/test_secured_colony.py: a revocation reaches a running colony",
    # Parts of the bridge, with real firmware on the other end.
    "crcolony_bridge/bridge_process.py": "system/test_bridge.py: bridges that are killed and restarted",
    "crcolony_bridge/start_bridge.py": "system/test_bridge.py: bridges that are killed and restarted",
    "crcolony_bridge/driver_body.py": "robot_firmware_bridge/test_driver_contract.py: drivers as bodies",
    "crcolony_bridge/driver_contract_test.py": "robot_firmware_bridge/test_driver_contract.py: it is a test, run there",
    "crcolony_bridge/driver_list.py": "robot_firmware_bridge/test_driver_plugin.py: what is listed",
    "crcolony_bridge/driver_registry.py": "robot_firmware_bridge/test_driver_plugin.py: drivers of other packages",
    "crcolony_bridge/errors.py": "robot_firmware_bridge/test_link.py: what is said of devices",
    "crcolony_bridge/reconnecting_driver.py": "robot_firmware_bridge/test_driver_contract.py: what drivers share",
    "crcolony_bridge/micropython/board.py": "robot_firmware_bridge/micropython/test_robot_script.py: uploaded with it",
    "crcolony_bridge/micropython/boards/microbit.py": "robot_firmware_bridge/micropython/test_driver.py: a micro:bit",
    "crcolony_bridge/micropython/boards/pololu_3pi_2040.py": "robot_firmware_bridge/micropython/test_boards.py: pins",
    "crcolony_bridge/micropython/boards/usb_console.py": "robot_firmware_bridge/micropython/test_boards.py: both",
    "crcolony_bridge/micropython/boards/xrp.py": "robot_firmware_bridge/micropython/test_boards.py: its pins",
    "crcolony_bridge/reference_firmware/messages.py": "robot_firmware_bridge/test_robot_core.py: the firmware's own",
    "crcolony_bridge/reference_firmware/session.py": "robot_firmware_bridge/reference_firmware/test_driver.py: replies",
    "crcolony_bridge/ros2/messages.py": "robot_firmware_bridge/ros2/test_cdr.py: every field, as ROS encodes it",
    "crcolony_bridge/ros2/session.py": "robot_firmware_bridge/ros2/test_driver.py: a router, a base, and their ends",
    # Deployments: values, and commands that real machines show.
    "crcolony/commands/compile.py": "crcolony/runtime/test_compile_ahead.py: the command, and what it compiles",
    "crcolony_deploy/errors.py": "deploy/test_inventory_file.py: how a wrong inventory is refused",
    "crcolony_deploy/inventory_variables.py": "deploy/test_inventory.py: values, read and checked there",
    "crcolony_deploy/doctor/access_proof.py": "deploy/doctor/test_access.py: what is in force, and sabotaged",
    "crcolony_deploy/doctor/finding.py": "deploy/doctor/test_examine.py: findings, printed",
    "crcolony_deploy/doctor/host_state.py": "system/test_lan_deployment.py: real hosts are examined",
    # Zenoh's side of the transport: real sessions, cables that are cut, hostile peers.
    "crcolony/transport/zenoh_arena.py": "system/test_hostile_peers.py: an arena on Zenoh under attack",
    "crcolony/transport/zenoh_samples.py": "system/test_hostile_peers.py: payloads of any size",
    "crcolony_dashboards/live.py": "system/test_dashboard.py: real dashboards of colonies of processes",
    "crcolony/telemetry/wait_for_states.py": "deploy/test_metrics.py: printed once, of real processes",
    "crcolony_deploy/metric_families.py": "deploy/test_metrics_exporter.py: the families of an exporter",
    # Layouts of tabs, which say nothing of their own.
    "crcolony_dashboards/tabs/arena_layout.py": "dashboards/tabs/test_colony.py: the tab as a whole",
    "crcolony_dashboards/tabs/measure_lines.py": "dashboards/tabs/test_colony_story.py: lines of charts",
}
"""Modules without a test file of their own: the test file, from `tests`, that tests them, and why, after a colon."""

ABOUT_SEVERAL = [
    "tests/crcolony/learning/test_mountain_car.py",
    "tests/crcolony/nodes/test_arena_node_world.py",
    "tests/crcolony/protocol/test_mating_among_robots.py",
    "tests/crcolony/protocol/test_mating_explored.py",
    "tests/crcolony/protocol/test_mating_recovery.py",
    "tests/crcolony/protocol/test_protocol_document.py",
    "tests/crcolony/storage/test_power_cut.py",
    "tests/crcolony/storage/test_store_against_model.py",
    "tests/crcolony/test_wrong_input.py",
    "tests/crcolony/world/test_body_contract.py",
    "tests/deploy/test_enrollment.py",
    "tests/deploy/test_monitoring.py",
    "tests/deploy/test_systemd_units.py",
    "tests/robot_firmware_bridge/aseba/test_driver_faults.py",
    "tests/robot_firmware_bridge/aseba/test_driver_words.py",
    "tests/robot_firmware_bridge/reference_firmware/test_driver_words.py",
    "tests/robot_firmware_bridge/test_driver_contract.py",
    "tests/robot_firmware_bridge/test_driver_plugin.py",
    "tests/robot_firmware_bridge/test_fuzz_robot.py",
    "tests/robot_firmware_bridge/test_robot_core.py",
    "tests/robot_firmware_bridge/test_transfer_example.py",
]
"""Test files that show what several modules do together."""

PATH = re.compile(
    r"`((?:configs|crcolony|dashboards|deploy|docs|examples|robot_firmware_bridge|tests)/[\w./-]+)`"
)
"""How documents name a file or folder of the checkout."""

PLACE = re.compile(r"`([\w./-]+\.py)(?::([\w.]+))?`")
"""How documents name a file, and a function or `Class.method` in it."""


def product_files() -> list[Path]:
    """Return every Python file of the product."""
    return sorted(path for folder in PRODUCT for path in folder.rglob("*.py"))


def name_of(path: Path) -> str:
    """Return a product file as its import path has it: `crcolony/robot/step.py`."""
    folder = next(folder for folder in PRODUCT if path.is_relative_to(folder))
    return path.relative_to(folder.parent).as_posix()


def functions_of(path: Path) -> Iterator[tuple[str, int]]:
    """Yield every function of a file as name and length in lines."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            yield node.name, node.end_lineno - node.lineno + 1


def test_the_drawing_of_the_rooms_is_that_of_the_code() -> None:
    """`python docs/draw_rooms.py` would change nothing in docs/architecture.md."""
    page = draw_rooms.PAGE.read_text("utf-8")
    drawing = draw_rooms.draw(draw_rooms.read_imports())
    assert draw_rooms.insert(page, drawing) == page, "run: python docs/draw_rooms.py"


def test_an_arrow_is_drawn_where_no_longer_way_leads() -> None:
    """The drawing leaves out what follows from other arrows, and shows a circle."""
    rooms = {"a": {"b", "c"}, "b": {"c"}, "c": set[str]()}
    assert draw_rooms.reduce(rooms) == {"a": {"b"}, "b": {"c"}, "c": set()}
    circle = {"a": {"b"}, "b": {"a", "c"}, "c": set[str]()}
    assert draw_rooms.reduce(circle) == circle


def test_every_room_is_in_the_contract_and_on_the_page() -> None:
    """No room is forgotten: import-linter has it in a layer, and docs/architecture.md says what it is for."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    layered = {name for layer in layers for name in layer.split(" | ")}
    drawn = set(draw_rooms.read_imports())
    rooms = {room if room in layered else f"crcolony.{room}" for room in drawn}
    rooms |= {f"crcolony.{module}" for module in draw_rooms.EVERYWHERE}
    assert rooms == layered
    page = draw_rooms.PAGE.read_text("utf-8")
    missing = [room for room in drawn | draw_rooms.EVERYWHERE if f"| `{room}" not in page]
    assert not missing, _lines(missing)


def test_files_are_short() -> None:
    """A file of the product has at most 300 lines."""
    lengths = {name_of(path): len(path.read_text("utf-8").splitlines()) for path in product_files()}
    too_long = [f"{name}: {lines}" for name, lines in lengths.items() if lines > MAX_FILE_LINES]
    assert not too_long, _lines(too_long)


def test_functions_are_short() -> None:
    """A function of the product has at most 60 lines."""
    too_long = [
        f"{name_of(path)}:{function}: {lines}"
        for path in product_files()
        for function, lines in functions_of(path)
        if lines > MAX_FUNCTION_LINES
    ]
    assert not too_long, _lines(too_long)


def test_every_module_has_its_tests() -> None:
    """`crcolony/robot/step.py` is tested by `tests/crcolony/robot/test_step.py`, or the table says where and why."""
    modules = {name_of(path) for path in product_files() if not path.name.startswith("__")}
    without = {name for name in modules if not _tests_of(name).exists()}
    untested = sorted(without - set(TESTED_ELSEWHERE))
    assert not untested, _lines(untested)
    assert set(TESTED_ELSEWHERE) <= without, "what has tests of its own needs no entry in the table"
    for entry in TESTED_ELSEWHERE.values():
        file, _, reason = entry.partition(": ")
        assert (ROOT / "tests" / file).exists(), entry
        assert reason, entry


def test_every_test_file_has_its_module() -> None:
    """A test file is named for a module of the product, or for what it shows of several."""
    strays = [
        path.relative_to(ROOT).as_posix()
        for folder in TESTS.values()
        for path in folder.rglob("test_*.py")
        if not _is_mirrored(path)
    ]
    assert sorted(strays) == sorted(ABOUT_SEVERAL), _lines(strays)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_documents_name_exists(document: Path) -> None:
    """Every file or folder, and every function in a file, that a document names in backticks is there."""
    text = document.read_text("utf-8")
    missing = [path for path in PATH.findall(text) if not (ROOT / path).exists()]
    missing += [match[0] for match in PLACE.finditer(text) if not _exists(*match.groups())]
    assert not missing, _lines(missing)


def test_pictures_and_links_of_documents_exist() -> None:
    """Every relative link of a document leads to a file."""
    broken = [
        f"{document.relative_to(ROOT)}: {target}"
        for document in DOCUMENTS
        for target in re.findall(r"\]\(([^)#:\s]+)(?:#[\w-]*)?\)", document.read_text("utf-8"))
        if not (document.parent / target).exists()
    ]
    assert not broken, _lines(broken)


def _lines(found: Iterable[str]) -> str:
    return "\n" + "\n".join(found)


def _tests_of(name: str) -> Path:
    package, _, rest = name.partition("/")
    module = Path(rest)
    return TESTS[package] / module.with_name(f"test_{module.name}")


def _is_mirrored(path: Path) -> bool:
    for package in PRODUCT:
        folder = TESTS[package.name]
        if path.is_relative_to(folder):
            module = package / path.relative_to(folder).with_name(path.name.removeprefix("test_"))
            return module.exists() or (module.with_suffix("") / "__init__.py").exists()
    return False


def _exists(file: str, name: str | None) -> bool:
    """Tell whether there is a file whose path ends so, and it defines the name."""
    folders = (
        "crcolony",
        "dashboards",
        "deploy",
        "docs",
        "examples",
        "robot_firmware_bridge",
        "tests",
    )
    paths = [path for folder in folders for path in (ROOT / folder).rglob(Path(file).name)]
    paths = [path for path in paths if f"/{path.relative_to(ROOT)}".endswith(f"/{file}")]
    return bool(paths) and (name is None or any(_defines(path, name) for path in paths))


def _defines(path: Path, name: str) -> bool:
    body: list[ast.stmt] = ast.parse(path.read_text("utf-8")).body
    for part in name.split("."):
        found = [node for node in body if part in _names(node)]
        if not found:
            return False
        body = getattr(found[0], "body", [])
    return True


def _names(node: ast.stmt) -> list[str]:
    """Return what a statement defines: a class, a function, or variables."""
    if isinstance(node, ast.ClassDef | ast.FunctionDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return [target.id for target in targets if isinstance(target, ast.Name)]
