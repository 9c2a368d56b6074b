# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev mutants`: puts one fault at a time into a copy of the last commit, and runs tests until one of them fails."""

import re
import subprocess
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from . import ROOT, DevError
from .environments import ALL, BPY45, Environment, require
from .steps import clean_environment, say

LIST = Path(__file__).with_name("mutants.toml")
LIMIT_SECONDS = 15 * 60
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+?::\S+|\S+)", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """A fault of mutants.toml: `old` in `file` becomes `new`. `tests` are paths below tests/, the quickest first."""

    name: str
    file: str
    old: str
    new: str
    tests: list[str]
    blender: str = BPY45.blender_version

    @property
    def environment(self) -> Environment:
        return next(one for one in ALL if one.blender_version == self.blender)


def all_mutants() -> list[Mutant]:
    """The faults of mutants.toml."""
    return [Mutant(**row) for row in tomllib.loads(LIST.read_text())["mutant"]]


@dataclass(frozen=True)
class Verdict:
    """The first test that fails, or "" for a survivor, and seconds of wall time until then."""

    mutant: Mutant
    test: str
    seconds: float


def named(words: Sequence[str]) -> list[Mutant]:
    """The mutants whose names contain one of the words; all without words. Raises DevError if there is none."""
    found = [mutant for mutant in all_mutants() if not words or any(word in mutant.name for word in words)]
    if not found:
        raise DevError(f"no mutant is named {' or '.join(words)}; remedy: ./dev mutants --list")
    return found


@contextmanager
def checkout() -> Iterator[Path]:
    """A worktree of the last commit, with the real scans beside it where this checkout has them."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as parent:
        folder = Path(parent, "main")
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--detach", "--quiet", str(folder), "HEAD"], check=True)
        if (ROOT.parent / "shared").is_dir():
            Path(parent, "shared").symlink_to(ROOT.parent / "shared")
        try:
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", str(folder)], check=True)


def text_with(mutant: Mutant, text: str) -> str:
    """The file's text with the fault. Raises DevError unless the old text occurs once."""
    if text.count(mutant.old) != 1:
        raise DevError(f"{mutant.file}: {mutant.name}: its text occurs {text.count(mutant.old)} times; remedy: move it")
    return text.replace(mutant.old, mutant.new)


def try_mutant(mutant: Mutant, folder: Path) -> Verdict:
    """Run the mutant's tests, with the cases of the short set, until the first failure."""
    path = folder / mutant.file
    sound = path.read_text()
    command = [str(mutant.environment.python), "-m", "pytest", "-x", "-q", "--short", "-p", "no:cacheprovider"]
    command += [f"tests/{test}" for test in mutant.tests]
    start = time.monotonic()
    path.write_text(text_with(mutant, sound))
    try:
        run = subprocess.run(
            command, cwd=folder, env=clean_environment(PYTHONPATH=str(folder), CI="true"), timeout=LIMIT_SECONDS,
            stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
        )  # fmt: skip
        output, status = run.stdout, run.returncode
    except subprocess.TimeoutExpired:
        output, status = "", 1
    finally:
        path.write_text(sound)
    failed = FAILED.search(output)
    test = "" if status == 0 else failed[1] if failed else f"exit status {status}"
    return Verdict(mutant, test, time.monotonic() - start)


def run(words: Sequence[str]) -> int:
    """Try the named mutants and print a line for each. Returns 0 if tests noticed all of them, else 1."""
    mutants = named(words)
    for environment in dict.fromkeys(mutant.environment for mutant in mutants):
        require(environment)
    survivors = 0
    with checkout() as folder:
        for mutant in mutants:
            say(mutant.name)
            verdict = try_mutant(mutant, folder)
            survivors += not verdict.test
            print(f"{verdict.seconds:6.1f} s  {mutant.name}: {verdict.test or 'SURVIVED'}", flush=True)
    print(f"\n{len(mutants) - survivors} of {len(mutants)} mutants noticed")
    return 1 if survivors else 0
