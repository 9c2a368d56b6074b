# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage-guided search for files that crash or stall the readers.

    python -m laboratory.benchmarks.hostile.guided [--count N] [--seed S] [--only .EXT] [--json FILE|-]

The search for a format begins with valid files. Each round spoils one of the kept files. A spoiled file is kept too if
it reaches a new step between two lines of a reader. A find is a file that a reader neither accepts nor refuses in one
line, or that takes longer than a second. Finds are printed; add them to tests/precompute/surface/test_finds.py."""

import random
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from precompute.base.failure import GratingError
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.surface.readers import reader_registry

from ..report import add_json, say, write
from .mutations import mutated
from .readers import BARE, FORMATS

_READERS = str(Path(reader_registry.__file__).parent)
_SECONDS_MAX = 1.0
_FINDS_MAX = 10


@dataclass
class Search:
    """State of a search: kept files, reached steps (file, line, next line), and finds with their faults."""

    kept: list[bytes]
    reached: set[tuple[str, int, int]] = field(default_factory=set)
    finds: list[tuple[bytes, str]] = field(default_factory=list)

    def run(self, take: Callable[[bytes], object], rounds: int, draw: random.Random) -> None:
        """Give `rounds` spoiled files to `take`, which raises GratingError if it refuses a file."""
        for data in self.kept:
            self._try(take, data)
        for _ in range(rounds):
            _, data = mutated(draw, draw.choice(self.kept))
            if self._try(take, data) and len(self.finds) < _FINDS_MAX:
                self.kept.append(data)

    def _try(self, take: Callable[[bytes], object], data: bytes) -> bool:
        """Read one file and return whether it reached a new step."""
        steps: set[tuple[str, int, int]] = set()
        start = time.process_time()
        sys.settrace(_tracer(steps))
        try:
            take(data)
        except GratingError as error:
            line = str(error)
            if "; " not in line or "\n" in line:
                self.finds.append((data, f"no line with a remedy: {line}"))
        except Exception as error:
            self.finds.append((data, f"{type(error).__name__}: {error}"))
        finally:
            sys.settrace(None)
        if time.process_time() - start > _SECONDS_MAX:
            self.finds.append((data, f"{time.process_time() - start:.1f} s"))
        new = bool(steps - self.reached)
        self.reached |= steps
        return new


def _tracer(steps: set[tuple[str, int, int]]) -> Callable:
    """Make a trace function that records each step between two lines of the readers."""

    def enter(frame: FrameType, event: str, _: object) -> Callable | None:
        name = frame.f_code.co_filename
        if not name.startswith(_READERS):
            return None
        before = 0

        def step(frame: FrameType, event: str, _: object) -> Callable:
            nonlocal before
            if event == "line":
                steps.add((name, before, frame.f_lineno))
                before = frame.f_lineno
            return step

        return step

    return enter


def _taker(path: Path) -> Callable[[bytes], object]:
    sizes = (1.0, 200.0) if path.suffix in BARE else ()

    def take(data: bytes) -> object:
        path.write_bytes(data)
        return reader_registry.read_height_map(str(path), *sizes)

    return take


def main(argv: list[str]) -> int:
    """Search all formats; return the exit status, 1 if there is a find."""
    parser = OneLineParser(prog="guided", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=count(1, 10**7), default=5000, metavar="N", help="files a format")
    parser.add_argument("--seed", type=count(0, 10**9), default=1, metavar="S", help="other seeds make other files")
    parser.add_argument("--only", default="", metavar=".EXT", help="only this format")
    add_json(parser)
    asked = parser.parse_args(argv)
    facts = {}
    for extension, makers in FORMATS.items():
        if asked.only not in ("", extension):
            continue
        with tempfile.TemporaryDirectory(prefix="guided-") as folder:
            search = Search([make() for make in makers])
            take = _taker(Path(folder) / f"file{extension}")
            search.run(take, asked.count, random.Random(f"{asked.seed} {extension}"))
        facts[extension] = {
            "kept": len(search.kept),
            "steps": len(search.reached),
            "finds": [{"what": what, "bytes": data.hex()} for data, what in search.finds],
        }
        say(f"{extension:6} {len(search.kept):5} kept, {len(search.reached):5} steps", asked.json)
        for data, what in search.finds:
            say(f"  FIND {what} ({len(data)} bytes)", asked.json)
    write(facts, asked.json)
    return 1 if any(each["finds"] for each in facts.values()) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
