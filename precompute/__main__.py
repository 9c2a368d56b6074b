# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m precompute VERB ...`: see cli/parser.py."""

import sys

from .cli.parser import main

if __name__ == "__main__":
    sys.exit(main())
