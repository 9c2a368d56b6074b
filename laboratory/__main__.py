# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m laboratory VERB`: a verb of the laboratory, or one of the product."""

import sys

from precompute.__main__ import run  # first, because it also chooses the number of threads before NumPy is imported

from .verbs import PACKAGES

if __name__ == "__main__":
    sys.exit(run(PACKAGES))
