"""The CPUs of a process are those of its affinity, less what control groups withhold."""

import os

import pytest

from crcolony.experiments.pools.usable_cpus import limited_cpus, usable_cpus

ROOT = "/sys/fs/cgroup"
V1 = f"{ROOT}/cpu,cpuacct"
OWN = "/proc/self/cgroup"


@pytest.mark.parametrize(
    ("files", "cpus"),
    [
        ({}, 8),
        ({OWN: "0::/\n"}, 8),
        ({OWN: "0::/\n", f"{ROOT}/cpu.max": "max 100000\n"}, 8),
        ({OWN: "0::/\n", f"{ROOT}/cpu.max": "200000 100000\n"}, 2),
        ({OWN: "0::/\n", f"{ROOT}/cpu.max": "150000 100000\n"}, 2),
        ({OWN: "0::/\n", f"{ROOT}/cpu.max": "1000 100000\n"}, 1),
        ({OWN: "0::/\n", f"{ROOT}/cpu.max": "9900000 100000\n"}, 8),
        ({OWN: "0::/a/b\n", f"{ROOT}/a/b/cpu.max": "300000 100000\n"}, 3),
        (
            {
                OWN: "0::/a/b\n",
                f"{ROOT}/a/b/cpu.max": "max 100000\n",
                f"{ROOT}/a/cpu.max": "400000 100000\n",
            },
            4,
        ),
        ({OWN: "0::/../other\n", f"{ROOT}/cpu.max": "200000 100000\n"}, 2),
        (
            {
                OWN: "9:memory:/m\n4:cpu,cpuacct:/docker/c\n1:name=systemd:/x:y\n0::/\n",
                f"{V1}/docker/c/cpu.cfs_quota_us": "500000\n",
                f"{V1}/docker/c/cpu.cfs_period_us": "100000\n",
            },
            5,
        ),
        (
            {
                OWN: "4:cpu,cpuacct:/docker/c\n",  # a container sees its own group as the root
                f"{V1}/cpu.cfs_quota_us": "250000\n",
                f"{V1}/cpu.cfs_period_us": "100000\n",
            },
            3,
        ),
        (
            {
                OWN: "4:cpu,cpuacct:/\n",
                f"{V1}/cpu.cfs_quota_us": "-1\n",
                f"{V1}/cpu.cfs_period_us": "100000\n",
            },
            8,
        ),
        ({OWN: "0::/\n", f"{ROOT}/cpu.max": "nonsense"}, 8),
    ],
)
def test_the_smallest_limit_of_all_groups_counts(files: dict[str, str], cpus: int) -> None:
    """In v1 and v2, in the own group and in those above; part of a CPU is rounded up."""

    def read(path: str) -> str:
        if path not in files:
            raise FileNotFoundError(path)
        return files[path]

    assert limited_cpus(8, read) == cpus


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system has no affinity")
def test_the_affinity_of_the_process_counts() -> None:
    """As `taskset` sets it."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        assert usable_cpus() == 1
    finally:
        os.sched_setaffinity(0, before)
