# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: every method of the core on the same surfaces."""
