# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints a verb's progress and its facts as JSON or text. Also rejects targets that cannot be written."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, TextIO

from ..base.failure import GratingError, printable
from ..base.files import told_of, write_whole
from ..base.job import is_forsaken


class Progress:
    """Reports progress on standard error: as lines of text, as lines of JSON for the parent program, or not at all.

    A line is printed when a stage begins, when it ends, and after every step of 1 % (JSON) or 25 % (text). Stages in
    `may_be_refused`, in which a verb may still refuse its files, are not printed as text: a refusal is one line. A run
    whose parent program is gone ends here, as if interrupted."""

    def __init__(self, style: str, may_be_refused: Collection[str] = ()):
        self.style = style
        self._quiet = may_be_refused if style == "text" else ()
        self._last: tuple[str | None, float] = (None, -1.0)

    def __call__(self, stage: str, fraction: float) -> None:
        if is_forsaken():
            raise KeyboardInterrupt
        last_stage, last_fraction = self._last
        step = 0.01 if self.style == "json" else 0.25
        if (
            self.style == "none"
            or stage in self._quiet
            or (stage == last_stage and fraction < min(1.0, last_fraction + step))
        ):
            return
        self._last = (stage, fraction)
        if self.style == "json":
            line = json.dumps({"stage": stage, "fraction": round(fraction, 4)})
        else:
            line = f"{stage}: {fraction:4.0%}"
        print(line, file=sys.stderr, flush=True)


def check_targets(arguments: argparse.Namespace) -> None:
    """Refuses, before any work is done, targets that could not be written afterwards, or would replace an input.

    Raises GratingError if --json or --output names a folder where a file is needed, a file where a folder is needed, or
    a file that another argument names. A verb whose output is a file sets the default `output_is_file`."""
    facts = getattr(arguments, "json", None)
    if facts and facts != "-":
        _check_file(Path(facts))
        if not Path(facts).parent.is_dir():
            raise GratingError(facts, "its folder does not exist", "create it first")
        refuse_to_replace(_inputs(arguments), [Path(facts)])
    output = getattr(arguments, "output", None)
    if output is None:
        return
    output_is_file = getattr(arguments, "output_is_file", False)
    if output_is_file:
        _check_file(output)
        refuse_to_replace(_inputs(arguments), [output])
    existing = next((each for each in (output, *output.parents) if each.exists()), None)
    if existing is not None and not existing.is_dir() and not (output_is_file and existing == output):
        raise GratingError(existing, "is a file", "name a folder")


def refuse_to_replace(inputs: Iterable[str | Path], targets: Iterable[Path]) -> None:
    """Raise GratingError if a file to be written is one of the files to be read."""
    files = {path for path in map(Path, inputs) if _is_file(path)}
    for target in targets:
        if _is_file(target) and any(target.samefile(path) for path in files):
            raise GratingError(target, "would be overwritten, but is an input", "write to another folder or file")


def _inputs(arguments: argparse.Namespace) -> list[str | Path]:
    """All values of the command line that may name a file to be read."""
    given = [value for name, value in vars(arguments).items() if name not in ("json", "output")]
    values = [each for value in given for each in (value if isinstance(value, list) else [value])]
    return [value for value in values if isinstance(value, (str, Path))]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a text that no file can have as its name
        return False


def _check_file(path: Path) -> None:
    if path.is_dir():
        raise GratingError(path, "is a folder", "name a file")
    if path.parent.exists() and not path.parent.is_dir():
        raise GratingError(path.parent, "is a file", "name a folder")


def emit(facts: Mapping[str, Any], target: str | None, summary: Callable[[], Iterable[str]]) -> None:
    """Write facts as JSON to the file `target`, or to standard output if `target` is "-".

    Otherwise prints the lines of `summary()`, the facts as text. Raises GratingError if the facts cannot be written, or
    if JSON is requested and a figure is not finite, which JSON cannot hold."""
    if target == "-":
        _print(_json(facts))
        return
    if target:
        _write_json(Path(target), _json(facts) + "\n")
    _print("\n".join(map(printable, summary())))


def _write_json(path: Path, text: str) -> None:
    """Write text directly to a pipe or a device, or atomically to a file."""
    if path.exists() and not path.is_file():
        with told_of(path):
            path.write_text(text)
    else:
        write_whole(path, lambda partial: partial.write_text(text))


def _print(text: str) -> None:
    try:
        print(text, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        leave_to_nobody(sys.stdout)
        raise GratingError("standard output", f"cannot be written ({error.strerror})", "send it elsewhere") from error


def leave_to_nobody(stream: TextIO) -> None:
    """Discard what a stream still holds, so that Python does not try to write it again at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def _json(facts: Mapping[str, Any]) -> str:
    try:
        return json.dumps(facts, indent=1, allow_nan=False)
    except ValueError as error:
        raise GratingError("--json", "a figure of the result is not finite", "leave --json out to see it") from error
