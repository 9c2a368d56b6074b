# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m benchmarks.hostile`, see __init__.py."""

import sys

from . import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
