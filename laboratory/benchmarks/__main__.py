# SPDX-License-Identifier: GPL-3.0-or-later
"""Run one benchmark, or all of them: every module of this package that has a main(argv)."""

import importlib
import os
import pkgutil
import subprocess
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
    """Run the benchmark named in argv, `[NAME [ARGUMENTS]]`; without a name, run all of them with their defaults, each
    in its own process, because Blender reads its user folder only once.

    Returns the status of the last benchmark that failed, 0 if all passed."""
    mains = found()
    if argv and argv[0] in ("-h", "--help"):
        print(f"usage: bench [NAME [ARGUMENTS]]\n\nNAME: {', '.join(mains)}; without it, all of them")
        return 0
    if argv and argv[0] not in mains:
        print(f"error: {argv[0]}: no such benchmark; choose one of {', '.join(mains)}", file=sys.stderr)
        return 2
    if argv:
        return mains[argv[0]](argv[1:]) or 0
    status = 0
    for name in mains:
        print(f"{name}:", flush=True)
        command = [sys.executable, "-m", __package__, name]
        status = subprocess.run(command, stdout=sys.stdout, stderr=sys.stderr).returncode or status
    return status


if __name__ == "__main__":
    # Blender prints a line for each tile and picture, thousands of lines around a table.
    keep_the_terminal_to_python()
    sys.exit(main(sys.argv[1:]))
