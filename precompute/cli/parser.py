# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: one file per verb, which is loaded when the verb is called.

Every error prints one line, which names the fault and the remedy, and gives a non-zero exit status.
"""

import argparse
import importlib
import re
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NoReturn

from ..base.failure import GratingError, printable
from ..base.strict import failure_line
from .printing import check_targets, leave_to_nobody

# The console command of an installed library.
COMMAND = "natural-gratings"
# The help text of each verb.
VERBS = {
    "info": "size, relief and periods of a height map",
    "bake": "bake height maps into the table that the material reads",
    "dft": "one .exr with the images that the OSL shaders of the thesis's algorithms read",
    "cache": "list, prune or verify the cache of bakes",
    "comb": "smooth fields of directions on meshes out of Blender",
    "job": "check a render job, list its pictures, join them, or send it to a farm",
    "map": "BRDF map over the hemisphere of view",
    "unwrap": "a UV map of a mesh, without overlaps",
}
# The verbs of each package. The verb `bake` is the module bake_verb of its package, with add_arguments(parser) and
# run(arguments).
PACKAGES = {__package__: VERBS}


# `--`, which ends the options, as the value of an option: Python's versions treat it differently.
_DASHES_AS_VALUE = re.compile(r"--[^=]+=--|-[^-]=?--")
# Characters of an argparse error message that are shown: the message repeats the arguments, however long.
_SHOWN = 400
_NO_MEMORY = "not enough memory", "crop the scan or ask for a shorter coherence length"


class OneLineParser(argparse.ArgumentParser):
    """A parser whose error message is one line."""

    def parse_known_args(  # type: ignore[override]  # argparse's overloads say the same of each kind of namespace
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Like argparse's. An option whose value is `--` is an error."""
        for each in args or ():
            if _DASHES_AS_VALUE.fullmatch(each):
                self.error(f"{each}: `--` is not a value")
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Print the message as one line, and exit with status 2."""
        if len(message) > _SHOWN:
            message = f"{message[: _SHOWN // 2]} ... {message[-_SHOWN // 2 :]}"
        print(f"error: {printable(message)}; see `{self.prog} --help`", file=sys.stderr)
        sys.exit(2)


def main(argv: Sequence[str] | None = None, packages: Mapping[str, Mapping[str, str]] = PACKAGES) -> int:
    """Run one verb of the command line `argv`, by default the program's own. Returns the exit status."""
    argv = sys.argv[1:] if argv is None else argv

    arguments = argparse.Namespace(progress="text")

    def run() -> object:
        build_parser(argv, packages).parse_args(argv, arguments)
        check_targets(arguments)
        try:
            return arguments.run(arguments)
        except MemoryError as error:
            scans = getattr(arguments, "files", None) or [getattr(arguments, "file", None)]
            if scans[0] is None:
                raise
            raise GratingError(scans[0], *_NO_MEMORY) from error

    return exit_status(run, lambda: str(arguments.progress))


def exit_status(run: Callable[[], object], style: Callable[[], str] = lambda: "text") -> int:
    """Run a command and return its exit status: the whole number that it returns, else 0. An error prints one line, of
    JSON if `style` then returns "json"."""

    def tell(error: GratingError) -> None:
        print(failure_line(error) if style() == "json" else f"error: {error}", file=sys.stderr)

    try:
        status = run()
    except GratingError as error:
        tell(error)
        return 1
    except MemoryError:
        tell(GratingError("", *_NO_MEMORY))
        return 1
    except BrokenPipeError:  # the reader of stdout stopped reading, as `head` does
        leave_to_nobody(sys.stdout)
        return 1
    except OSError as error:
        what, fault = (str(error.filename), str(error.strerror)) if error.filename else ("", str(error))
        tell(GratingError(what, fault, "check the path, its permissions, and the space left there"))
        return 1
    except KeyboardInterrupt as stop:
        number = signal.Signals(stop.args[0] if stop.args else signal.SIGINT)
        tell(GratingError("", f"stopped by {number.name}", "nothing was written"))
        return 128 + number
    return status if isinstance(status, int) else 0


def build_parser(
    argv: Sequence[str] = tuple(VERBS), packages: Mapping[str, Mapping[str, str]] = PACKAGES
) -> OneLineParser:
    """Build the parser of every verb of the packages. Only the verbs in `argv` are loaded and know their arguments."""
    prog = COMMAND if Path(sys.argv[0]).stem == COMMAND else "grating"
    parser = OneLineParser(prog=prog, description="From a height map to a diffraction table.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=OneLineParser)
    for package, texts in packages.items():
        for name, text in texts.items():
            verb = verbs.add_parser(name, help=text)
            if name in argv:
                module = importlib.import_module(f"{package}.{name}_verb")
                module.add_arguments(verb)
                verb.set_defaults(run=module.run)
    return parser
