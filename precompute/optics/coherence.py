# SPDX-License-Identifier: GPL-3.0-or-later
"""The coherence window of the ensemble model: how wide the kernel is that the bake holds in (u, v).

A Gaussian amplitude window of standard deviation sigma_s, averaged over its positions, blurs the power spectrum by a
Gaussian of standard deviation 1 / (2 pi sqrt(2) sigma_s) in q. "Coherence length" is 4 sigma_s, as in the thesis. The
kernel is fixed in (u, v), so the length is that of the reference wavelength and scales with the wavelength.
"""

import math

REFERENCE_WAVELENGTH_M = 550e-9


MINIMUM_AREAS = 30


def kernel_sigma(coherence_length_m: float) -> float:
    """Standard deviation sigma_b of the kernel in (u, v), for a coherence length 4 sigma_s in metres."""
    return REFERENCE_WAVELENGTH_M / (2 * math.pi * math.sqrt(2) * coherence_length_m / 4)


def coherence_length(sigma_b: float) -> float:
    """Coherence length 4 sigma_s in metres of a kernel sigma_b: the inverse of kernel_sigma."""
    return kernel_sigma(1.0) / sigma_b


def coherence_areas(size_m: tuple[float, float], coherence_length_m: float, profiles_m: float = 0.0) -> float:
    """How many coherence areas a scan of size (Ly, Lx) metres averages, and profiles of so much length in all, which do
    not change across.

    Two windows count as separate when the square of their overlap has fallen to 1/e: a shift of sqrt(2) sigma_s."""
    shift = math.sqrt(2) * coherence_length_m / 4
    return size_m[0] * size_m[1] / shift**2 + profiles_m / shift


def longest_averaging_length(area_m2: float, profiles_m: float = 0.0) -> float:
    """The longest coherence length that still averages MINIMUM_AREAS (less is mostly speckle) over scans of so much
    area and profiles of so much length in all."""
    half = profiles_m / 2
    shift = (half + math.sqrt(half**2 + MINIMUM_AREAS * area_m2)) / MINIMUM_AREAS
    return 4 * shift / math.sqrt(2)


def narrowest_averaging_kernel(size_m: tuple[float, float]) -> float:
    """The narrowest sigma_b that still averages MINIMUM_AREAS coherence areas of a scan (less is mostly speckle)."""
    return kernel_sigma(longest_averaging_length(size_m[0] * size_m[1]))


THESIS_COHERENCE_M = 65e-6
