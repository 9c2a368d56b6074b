# SPDX-License-Identifier: GPL-3.0-or-later
"""The truth that everything else is measured against."""
