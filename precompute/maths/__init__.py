# SPDX-License-Identifier: GPL-3.0-or-later
"""Pure mathematics: Chebyshev polynomials and cubic B-splines."""
