"""A robot's secret key is in its key file and in a backup with keys, both for its owner alone, and nowhere else."""

from pathlib import Path

from tests.support.command_line import run_command
from tests.support.process_colony import colony


def test_no_secret_key_leaves_its_file(tmp_path: Path) -> None:
    """Neither in logs, JSON or not, nor in telemetry, metrics, robots' files, checkpoints, or a backup without keys."""
    with colony(tmp_path) as made:
        made.arena(2, "--hz", "20", "--log-format", "json")
        one, _ = made.robot("--log-format", "json"), made.robot()
        view = made.observer()
        view.wait_for_matings(2, of=one.id)
        metrics = run_command("metrics", "--connect", made.endpoint)
        (tmp_path / "metrics").write_text(metrics.stdout)
        words = (made.folder, "--to", tmp_path / "backup.tar", "--without-keys")
        assert run_command("backup", *words).returncode == 0
        made.stop_robots()
        keys = [robot.folder / "key" for robot in made.robots]
        secrets = [bytes.fromhex(key.read_text()) for key in keys]
    assert all(key.stat().st_mode & 0o777 == 0o600 for key in keys)
    others = [path for path in tmp_path.rglob("*") if path.is_file() and path not in keys]
    assert {"metrics", "backup.tar", "robot.sqlite", "arena.npz"} <= {path.name for path in others}
    for path in others:
        content = path.read_bytes()
        for secret in secrets:
            assert secret not in content, path
            assert secret.hex().encode() not in content.lower(), path
