# SPDX-License-Identifier: GPL-3.0-or-later
"""Mathematics without optics: Chebyshev polynomials and cubic B-splines."""
