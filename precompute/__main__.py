# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m precompute VERB ...`: see cli/parser.py."""

import os
import sys

# NumPy reads it once, as it is imported. The matrix products here are too small to gain from threads, which wait for
# each other wherever other work holds the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from .cli.parser import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
