# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sessions: every button of the extension, an artist's acts, undo and redo, in random order.

    ./dev --bpy 5.2 bench random_steps [--steps 300] [--seed 0] [--seeds 1] [--json FILE|-]

Each session runs in its own Blender process, from a factory scene. After each step nothing may have raised or printed a
traceback, a refusal must have one line and have changed nothing, all panels must draw, the gratings and their drivers
must be consistent, and undo and redo must restore the data-blocks of that state. At the end all is deleted and purged,
and nothing of the extension may be left. A crash, and a step of more than 20 processor seconds, are failures. The
program then prints the seed, the step and the last ten steps, and exits with status 1. `done` in the JSON counts the
steps that were not refused. tests/addon runs a short session (hostile/steps_session.py)."""

import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from . import report
from .hostile import steps_session

# Seconds without a step's end after which Blender is stopped. More than a step's processor time, as the machine may be
# busy; a hang may also take no processor time.
_PATIENCE = 240
_TOLD = 10


def main(argv: list[str]) -> int:
    """Run the sessions; return the exit status, 1 if one failed."""
    parser = OneLineParser(prog="./dev bench random_steps", description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=count(1, 10**5), default=300, metavar="N", help="steps; default 300")
    parser.add_argument("--seed", type=count(0, 10**9), default=0, metavar="S", help="the first seed; default 0")
    parser.add_argument("--seeds", type=count(1, 10**4), default=1, metavar="N", help="sessions; default 1")
    report.add_json(parser)
    asked = parser.parse_args(argv)
    sessions = []
    for seed in range(asked.seed, asked.seed + asked.seeds):
        session = _session(seed, asked.steps)
        sessions.append(session)
        report.say(_line(session), asked.json)
        for step in session["last"]:
            report.say(f"  {step}", asked.json)
    report.write({"steps": asked.steps, "sessions": sessions}, asked.json)
    return 1 if any(session["fault"] for session in sessions) else 0


def _session(seed: int, steps: int) -> dict[str, Any]:
    """Run a session in its own process; return its facts."""
    with tempfile.TemporaryDirectory(prefix="random-steps-") as folder, tempfile.TemporaryFile() as printed:
        records = Path(folder) / "records"
        given = {"seed": seed, "steps": steps, "cache": str(Path(folder) / "cache")}
        command = [sys.executable, "-m", steps_session.__name__, folder, json.dumps(given)]
        process = subprocess.Popen(command, stdout=printed, stderr=printed)
        status = _wait(process, records)
        told = [json.loads(line) for line in records.read_text().splitlines()] if records.exists() else []
    ended = [record for record in told if "fault" in record]
    fault = ended[-1]["fault"] if ended else ""
    if not fault and (status or not ended):
        fault = "Blender hung" if status is None else f"Blender ended with status {status}"
    begun = [record for record in told if "fault" not in record]
    return {
        "seed": seed,
        "steps": len(ended),
        "refused": sum(bool(record["refusal"]) for record in ended),
        "done": dict(Counter(record["does"].partition("(")[0] for record in ended if not record["refusal"])),
        "slowest": max(ended, key=lambda record: record["seconds"], default=None),
        "fault": fault,
        "last": [f"{record['step']}: {record['does']}" for record in begun[-_TOLD:]] if fault else [],
    }


def _wait(process: subprocess.Popen, records: Path) -> int | None:
    """Wait for a session; return its exit status, or None if it was stopped because no step ended."""
    while True:
        try:
            return process.wait(2.0)
        except subprocess.TimeoutExpired:
            began = records.stat().st_mtime if records.exists() else time.time()
            if time.time() - began > _PATIENCE:
                process.kill()
                process.wait()
                return None


def _line(session: dict[str, Any]) -> str:
    """A line about a session."""
    slowest = session["slowest"]
    told = f"seed {session['seed']}: {session['steps']} steps, {session['refused']} refused"
    if slowest is not None:
        told += f", slowest {slowest['seconds']:.1f} s ({slowest['does']})"
    return f"{told}; {'FAILED: ' + session['fault'] if session['fault'] else 'no fault'}"
