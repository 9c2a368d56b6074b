# SPDX-License-Identifier: GPL-3.0-or-later
"""Methods that evaluate the spectrum of a relief, and the registry that lists them.

They are the exact references, the thesis's methods (FLSS, NMM, PQ), its baselines (Stam's form, the rainbow of GPU
Gems), a Chebyshev series, and the bake. The images of terms that OSL shaders read are made here too."""
