# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m tests.hostile`."""

import sys

from . import main

sys.exit(main(sys.argv[1:]))
