# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a table: the request, the plan, the tiles, the self-check, the cache."""
