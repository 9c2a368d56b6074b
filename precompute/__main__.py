# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs `python -m precompute VERB` (see cli/parser.py)."""

import os
import signal
import sys

# NumPy's BLAS reads these variables once, when NumPy is imported. With one thread the sums of a bake have a fixed
# order, so the file has the same bytes on any number of cores. The matrices here are too small to gain from threads,
# and threads wait for each other on a busy machine.
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[variable] = "1"
# An interrupt during the imports ends the program without a traceback.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .cli.program import run  # noqa: E402

if __name__ == "__main__":
    sys.exit(run())
