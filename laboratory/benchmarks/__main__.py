# SPDX-License-Identifier: GPL-3.0-or-later
"""Run one benchmark: a module of this package that has a main(argv)."""

import importlib
import os
import pkgutil
import sys
from collections.abc import Callable

# NumPy's BLAS reads this once, when NumPy is imported. The matrices here are small, and threads wait for each other on
# a busy machine: `rcwa_orders --quick` took 120 s with two threads on two busy cores, and 7 s with one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from precompute.cli.program import keep_the_terminal_to_python  # noqa: E402

from .. import benchmarks  # noqa: E402


def found() -> dict[str, Callable]:
    """The benchmarks by name, each with its main."""
    names = [module.name for module in pkgutil.iter_modules(benchmarks.__path__) if not module.name.startswith("_")]
    modules = {name: importlib.import_module(f"{benchmarks.__name__}.{name}") for name in names}
    return {name: module.main for name, module in modules.items() if hasattr(module, "main")}


def main(argv: list[str]) -> int:
    """Run the benchmark named in argv, `NAME [ARGUMENTS]`; without a name, list them. Returns the exit status."""
    mains = found()
    if not argv or argv[0] in ("-h", "--help"):
        print(f"usage: bench NAME [ARGUMENTS]\n\nNAME: {', '.join(mains)}")
        return 0
    if argv[0] not in mains:
        print(f"error: {argv[0]}: no such benchmark; choose one of {', '.join(mains)}", file=sys.stderr)
        return 2
    return mains[argv[0]](argv[1:]) or 0


if __name__ == "__main__":
    # Blender prints a line for each tile and picture, thousands of lines around a table.
    keep_the_terminal_to_python()
    sys.exit(main(sys.argv[1:]))
