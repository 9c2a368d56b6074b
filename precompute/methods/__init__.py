# SPDX-License-Identifier: GPL-3.0-or-later
"""Methods that evaluate the spectrum of a relief, and their registry.

They are the exact references, the thesis's methods (FLSS, NMM, PQ), its baselines (Stam's form, the rainbow of GPU
Gems), a Chebyshev series, and the bake. This folder also makes the images of terms that OSL shaders read."""
