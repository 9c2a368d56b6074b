# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m precompute VERB`: see cli/parser.py."""

import os
import signal
import sys

# NumPy's library of matrix products reads its variable once, as it is imported. With one thread a bake's sums have one
# order, and its file the same bytes, however many cores there are. The products here are too small to gain from
# threads, which wait for each other wherever other work holds the cores.
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[variable] = "1"
# An interrupt while the program is still loading ends it without a traceback.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .cli.program import run  # noqa: E402

if __name__ == "__main__":
    sys.exit(run())
