# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one hostile case in a child process under limits, and judges the result.

A child is forked for each case, so cases cannot affect each other. This needs fork, RLIMIT_AS and /proc, which Linux
has. The memory limit counts what the child allocates beyond its parent's memory. The time limit counts processor time,
so that a busy machine fails no case. A case that waits for ever (on a fifo) is killed after a minute."""

import contextlib
import os
import resource
import select
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from laboratory.verbs import PACKAGES
from precompute.base.failure import GratingError
from precompute.cli import parser

ACCEPTED, REFUSED, FAILED = "accepted", "refused", "failed"
# Limits of one case: processor seconds, and bytes beyond the parent's.
SECONDS_MAX, BYTES_MAX = 5, 1 << 30
# Seconds after which a case is stopped as hanging.
_CLOCK_SECONDS = 60
# A refusal must fit into this many characters.
_LINE_MAX = 1000
# Columns of /proc/self/statm.
_ADDRESS_SPACE, _RESIDENT = 0, 1


@dataclass(frozen=True)
class Case:
    """One hostile input.

    name         "GROUP NUMBER: what was done to it"; the same for the same seed
    group        the row of the table that counts it: a reader's, a verb's
    run          processes the input: returns if it is accepted, raises GratingError if it is refused; any other
                 exception fails the case
    names        a text that the refusal must contain, for example the file's name; None for no requirement
    seconds_max  the limit of processor seconds; None for SECONDS_MAX
    """

    name: str
    group: str
    run: Callable[[], object]
    names: str | None = None
    seconds_max: int | None = None


@dataclass(frozen=True)
class Outcome:
    """A case's result: verdict, line of the refusal or fault, processor seconds, peak bytes beyond the parent's."""

    name: str
    group: str
    verdict: str
    line: str
    seconds: float
    peak_bytes: int


def read_written(file: Path, data: bytes, read: Callable[[Path], object]) -> None:
    """Write a file, give it to `read`, and remove it; for a case's `run`."""
    file.write_bytes(data)
    try:
        read(file)
    finally:
        file.unlink()


def run_verb(argv: Sequence[object]) -> None:
    """Run a command line in this process, for a case's `run`.

    Raises GratingError with the printed line if the verb refuses. Raises AssertionError if a refusal is not one line
    "error: ..." on standard error with status 1 or 2, or if Python printed a warning."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as out, tempfile.TemporaryFile("w+", encoding="utf-8") as err:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                status = parser.main([str(each) for each in argv], PACKAGES)
            except SystemExit as end:
                status = end.code
        err.seek(0)
        printed = err.read()
    if status == 0:
        assert "Warning" not in printed, printed
        return
    lines = printed.splitlines()
    assert status in (1, 2) and len(lines) == 1 and lines[0].startswith("error: "), f"status {status}: {printed}"
    raise GratingError("", lines[0].removeprefix("error: "), "")


def run(case: Case) -> Outcome:
    """Run a case in a child process and judge it."""
    with tempfile.TemporaryFile() as said:
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if child == 0:
            _in_child(case, said.fileno())
        killed, usage, status = _wait(child)
        said.seek(0)
        # A killed child has written only its first line.
        at_start, verdict, line = f"{said.read().decode('utf-8', 'replace')}\n\n".split("\n", 2)
    line = line.strip()
    seconds = usage.ru_utime + usage.ru_stime
    peak = max(0, usage.ru_maxrss * 1024 - int(at_start))
    if killed:
        verdict, line = FAILED, f"not over after {_CLOCK_SECONDS} s"
    elif os.WIFSIGNALED(status):
        name = signal.Signals(os.WTERMSIG(status)).name
        verdict, line = FAILED, f"over {_limit(case)} s of the processor" if name == "SIGXCPU" else f"died of {name}"
    elif not verdict:
        verdict, line = FAILED, f"left with status {os.waitstatus_to_exitcode(status)}"
    elif verdict == REFUSED and (fault := _fault_of(line, case.names)):
        verdict, line = FAILED, f"{fault}: {line!r}"
    return Outcome(case.name, case.group, verdict, line, seconds, peak)


def table(outcomes: Sequence[Outcome]) -> str:
    """A text table: for each group its counts, slowest case and largest case; then each failed case with its fault."""
    lines = [f"{'group':<14}{'cases':>6}{'accepted':>9}{'refused':>8}{'failed':>7}  slowest / most memory"]
    for group in dict.fromkeys(outcome.group for outcome in outcomes):
        own = [outcome for outcome in outcomes if outcome.group == group]
        counts = [sum(each.verdict == verdict for each in own) for verdict in (ACCEPTED, REFUSED, FAILED)]
        slow, large = max(own, key=lambda each: each.seconds), max(own, key=lambda each: each.peak_bytes)
        lines.append(
            f"{group:<14}{len(own):>6}{counts[0]:>9}{counts[1]:>8}{counts[2]:>7}  {slow.seconds:.2f} s ({slow.name}) / "
            f"{large.peak_bytes / 2**20:.0f} MiB ({large.name})"
        )
    lines += [f"FAILED {each.name}\n  {each.line}" for each in outcomes if each.verdict == FAILED]
    return "\n".join(lines)


def _in_child(case: Case, said: int) -> None:
    """Run the case and end this process. Writes three lines to the file descriptor `said`: the bytes in memory at the
    start, the verdict, and the line of the refusal or the fault.

    Streams are redirected as file descriptors, because decoders written in C print there."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (_limit(case), _limit(case) + 1))
    limit = _own_bytes(_ADDRESS_SPACE) + BYTES_MAX
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    os.write(said, f"{_own_bytes(_RESIDENT)}\n".encode())
    try:
        case.run()
        verdict, line = ACCEPTED, ""
    except GratingError as error:
        verdict, line = REFUSED, str(error)
    except BaseException:  # every exception is a fault to report
        verdict, line = FAILED, traceback.format_exc()
    with contextlib.suppress(Exception):
        sys.stdout.flush()
        sys.stderr.flush()
    os.write(said, f"{verdict}\n{line}".encode("utf-8", "backslashreplace"))
    os._exit(0)


def _limit(case: Case) -> int:
    """The case's limit of processor seconds."""
    return case.seconds_max or SECONDS_MAX


def _wait(child: int) -> tuple[bool, resource.struct_rusage, int]:
    """Wait for a child; return whether it was killed on timeout, its resource usage, and its status."""
    watch = os.pidfd_open(child)
    ended, _, _ = select.select([watch], [], [], _CLOCK_SECONDS)
    os.close(watch)
    if not ended:
        os.kill(child, signal.SIGKILL)
    _, status, usage = os.wait4(child, 0)
    return not ended, usage, status


def _fault_of(line: str, names: str | None) -> str:
    """What is wrong with a refusal's line; "" if nothing is."""
    if not line.isprintable():
        return "a line that does not print"
    if "; " not in line:
        return "a line without a remedy"
    if len(line) > _LINE_MAX:
        return f"a line of {len(line)} characters"
    return f"a line that does not name {names}" if names is not None and names not in line else ""


def _own_bytes(column: int) -> int:
    """Bytes of this process: address space or resident memory, by the column."""
    return int(Path("/proc/self/statm").read_text().split()[column]) * resource.getpagesize()
