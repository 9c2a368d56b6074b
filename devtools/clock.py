# SPDX-License-Identifier: GPL-3.0-or-later
"""A pytest plugin for `./dev test --clock`: seconds of processor and wall time of each test, as JSON lines."""

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest


def _seconds() -> tuple[float, float]:
    """Seconds of processor time of this process and its ended children, and seconds of wall time."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system, time.monotonic()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    yield from _clocked(item, "all")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    yield from _clocked(item, "setup")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    yield from _clocked(item, "call")


def _clocked(item: pytest.Item, phase: str) -> Iterator[None]:
    cpu, wall = _seconds()
    yield
    after_cpu, after_wall = _seconds()
    line = {"test": item.nodeid, "phase": phase, "cpu": round(after_cpu - cpu, 3), "wall": round(after_wall - wall, 3)}
    with Path(os.environ["NATURAL_GRATINGS_CLOCK"]).open("a") as file:
        file.write(json.dumps(line) + "\n")
