# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: every method of the product on the same surfaces."""
