# SPDX-License-Identifier: GPL-3.0-or-later
"""How far colours are from the truth: direction pairs and error metrics."""
