# SPDX-License-Identifier: GPL-3.0-or-later
"""The runner of hostile cases reports each way to fail."""

import os
import signal
import sys
import time

import numpy as np
import pytest

from precompute.base.failure import GratingError
from tests import hostile
from tests.hostile import runner


def refuse(line):
    """Refuse with an unchanged line; GratingError itself would make it printable."""

    class Bare(GratingError):
        def __str__(self):
            return line

    raise Bare("", "", "")


def outcome_of(run, names=None):
    return runner.run(runner.Case("group 0: done", "group", run, names))


def test_what_returns_is_accepted():
    outcome = outcome_of(lambda: None)
    assert (outcome.verdict, outcome.line) == (runner.ACCEPTED, "")


def test_a_line_with_fault_and_remedy_is_a_refusal():
    outcome = outcome_of(lambda: refuse("a.png: broken; mend it"), names="a.png")
    assert (outcome.verdict, outcome.line) == (runner.REFUSED, "a.png: broken; mend it")


@pytest.mark.parametrize(
    "run, said",
    [
        (lambda: refuse("a.png: broken"), "without a remedy"),
        (lambda: refuse("b.png: broken; mend it"), "does not name a.png"),
        (lambda: refuse("a.png: broken\x1b[2J; mend it"), "does not print"),
        (lambda: refuse(f"a.png: {'9' * 2000}; mend it"), "2016 characters"),
        (lambda: {}["key"], "KeyError"),
        (lambda: sys.exit(3), "SystemExit"),
        (lambda: os._exit(3), "status 3"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "SIGKILL"),
        (lambda: np.ones(3 << 27), "MemoryError"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_every_other_end_fails(run, said):
    outcome = outcome_of(run, names="a.png")
    assert outcome.verdict == runner.FAILED
    assert said in outcome.line


def test_work_without_end_is_stopped(monkeypatch):
    def spin():
        while True:
            pass

    own = runner.run(runner.Case("group 0: done", "group", spin, seconds_max=1))
    assert own.verdict == runner.FAILED and "over 1 s of the processor" in own.line
    monkeypatch.setattr(runner, "SECONDS_MAX", 1)
    assert "1 s of the processor" in outcome_of(spin).line
    monkeypatch.setattr(runner, "_CLOCK_SECONDS", 0.2)
    assert "not over after" in outcome_of(lambda: time.sleep(60)).line


def test_memory_is_measured():
    outcome = outcome_of(lambda: np.ones(1 << 25).sum())
    assert outcome.verdict == runner.ACCEPTED
    assert 1 << 28 <= outcome.peak_bytes < 1.2 * (1 << 28)


def test_a_verb_is_run_in_a_case():
    assert outcome_of(lambda: runner.run_verb(["info", "sample:flat"])).verdict == runner.ACCEPTED
    outcome = outcome_of(lambda: runner.run_verb(["info", "sample:nothing"]), names="sample:nothing")
    assert outcome.verdict == runner.REFUSED


def test_a_failed_case_ends_the_program_with_status_1(monkeypatch, capsys):
    cases = {"good": lambda: None, "bad": lambda: {}["key"]}
    for name, status in (("good", 0), ("bad", 1)):
        case = runner.Case(f"{name} 0: nothing", name, cases[name])
        monkeypatch.setattr(hostile, "SUITES", {"suite": lambda count, seed, folder, case=case: [case]})
        assert hostile.main(["suite", "--count", "1"]) == status
        assert f"FAILED {name} 0" in capsys.readouterr().out or name == "good"
