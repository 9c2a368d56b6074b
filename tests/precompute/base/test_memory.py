# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory, read from the files of a simulated system."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from precompute.base import machine
from precompute.base.failure import GratingError

ROOT = Path(__file__).resolve().parents[3]
GIB = 1 << 30


@pytest.fixture
def system(tmp_path, monkeypatch):
    """A function that writes a system's files and returns its free memory. This process has no limit."""
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

    def free(files):
        for name, text in {"proc/meminfo": f"MemTotal: 1 kB\nMemAvailable: {16 * GIB >> 10} kB\n", **files}.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text)
        return machine.free_bytes(tmp_path)

    return free


def test_a_machine_without_groups(system):
    assert system({}) == 16 * GIB


def test_a_group_of_the_second_version_and_those_around_it(system):
    group = "sys/fs/cgroup"
    files = {
        "proc/self/cgroup": "0::/a/b\n",
        f"{group}/a/b/memory.max": "max\n",
        f"{group}/a/b/memory.current": f"{GIB}\n",
        f"{group}/a/memory.max": f"{4 * GIB}\n",
        f"{group}/a/memory.current": f"{3 * GIB}\n",
        f"{group}/a/memory.stat": f"anon 1\ninactive_file {GIB}\n",
    }
    assert system(files) == 2 * GIB


@pytest.mark.parametrize("folder", ["sys/fs/cgroup/memory/docker/x", "sys/fs/cgroup/memory"])
def test_a_group_of_the_first_version_by_its_name_or_as_a_container_sees_it(system, folder):
    files = {
        "proc/self/cgroup": "5:cpu:/\n4:memory:/docker/x\n0::/\n",
        f"{folder}/memory.limit_in_bytes": f"{2 * GIB}\n",
        f"{folder}/memory.usage_in_bytes": f"{GIB}\n",
        f"{folder}/memory.stat": "inactive_file 7\ntotal_inactive_file 5\n",
    }
    assert system(files) == GIB + 5


def test_a_limit_of_the_address_space(system, monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (3 * GIB, 3 * GIB))
    assert system({"proc/self/statm": f"{GIB // resource.getpagesize()} 1 1\n"}) == 2 * GIB


def test_more_taken_than_allowed_leaves_nothing(system):
    files = {"proc/self/cgroup": "0::/\n", "sys/fs/cgroup/memory.max": "5\n", "sys/fs/cgroup/memory.current": "9\n"}
    assert system(files) == 0


def test_half_of_what_is_free_may_be_taken(monkeypatch):
    monkeypatch.setattr(machine, "free_bytes", lambda: 4 * GIB)
    machine.refuse_beyond_memory(2 * GIB, "a.png: reading", "crop it")
    with pytest.raises(GratingError, match="a.png: reading would take 2.1 GiB .* half of the 4 GiB .*; crop it"):
        machine.refuse_beyond_memory(2.1 * GIB, "reading", "crop it", source="a.png")


def test_nothing_is_refused_where_nothing_is_known(monkeypatch):
    monkeypatch.setattr(machine, "free_bytes", lambda: None)
    machine.refuse_beyond_memory(1e30, "a.png: reading", "crop it")


def test_a_system_without_any_of_it(tmp_path, monkeypatch):
    """As on Windows: no /proc, no sysconf, no resource."""
    monkeypatch.setattr(machine, "resource", None)
    monkeypatch.setattr(machine.os, "sysconf_names", {})
    assert machine.free_bytes(tmp_path) is None


def test_this_machine_has_some():
    """A child under a limit of 2 GiB has less than that."""
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30));"
        "from precompute.base.machine import free_bytes; print(free_bytes())"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert 0 < int(found.stdout) < 2 * GIB
