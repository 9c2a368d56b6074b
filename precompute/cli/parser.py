# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: a verb a file, loaded when it is called. Whatever is wrong, one line of fault and remedy, and a
non-zero exit."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from ..base.failure import GratingError
from .output import check_targets

# Each is a module of this folder with add_arguments(parser) and run(arguments).
VERBS = {
    "info": "size, relief and periods of a height map",
    "bake": "bake height maps into the table that the material reads",
    "dft": "the images that the OSL shaders of the thesis's algorithms read, one .exr",
    "check": "recompute a bake's error from its files alone",
    "map": "BRDF map over the hemisphere of view",
    "evaluate": "the period that each method's colours tell of",
    "efficiency": "a grating's orders against their closed forms",
    "benchmark": "speed against error: every method on the same surfaces",
}


class OneLineParser(argparse.ArgumentParser):
    """A parser whose complaint is one line."""

    def error(self, message: str):
        print(f"error: {message}; see `{self.prog} --help`", file=sys.stderr)
        sys.exit(2)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb; the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    arguments = build_parser(argv).parse_args(argv)
    try:
        check_targets(arguments)
        arguments.run(arguments)
    except GratingError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except MemoryError:
        print("error: not enough memory; crop the scan or ask for a shorter coherence length", file=sys.stderr)
        return 1
    except BrokenPipeError:  # whoever read our output has had enough
        sys.stderr.close()
        return 1
    except OSError as error:
        what = f"{error.filename}: {error.strerror}" if error.filename else error
        print(f"error: {what}; check the path and its permissions", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("error: interrupted; nothing was written", file=sys.stderr)
        return 130
    return 0


def build_parser(argv: Sequence[str] = tuple(VERBS)) -> OneLineParser:
    """The parser of every verb. Only the verbs that `argv` names are loaded and know their arguments."""
    parser = OneLineParser(prog="grating", description="From a height map to a diffraction table.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=OneLineParser)
    for name, text in VERBS.items():
        verb = verbs.add_parser(name, help=text)
        if name in argv:
            module = importlib.import_module(f".{name}", __package__)
            module.add_arguments(verb)
            verb.set_defaults(run=module.run)
    return parser
