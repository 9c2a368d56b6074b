# SPDX-License-Identifier: GPL-3.0-or-later
"""Coherence length and kernel width of the ensemble model (docs/theory.md, Coherence).

A Gaussian amplitude window of standard deviation sigma_s, averaged over its positions, blurs the power spectrum by a
Gaussian of standard deviation 1 / (2 pi sqrt(2) sigma_s) in the spatial frequency q = (u, v) / lambda. The coherence
length is 4 sigma_s, as in the thesis. The kernel is a Gaussian of fixed standard deviation sigma_b in (u, v), so the
coherence length is proportional to the wavelength. All coherence lengths in this project are given at
REFERENCE_WAVELENGTH_M.
"""

import math

REFERENCE_WAVELENGTH_M = 550e-9
# The default kernel averages this many coherence areas. An average over fewer areas is mostly speckle.
MINIMUM_AREAS = 30
# A kernel is narrowed by what an apodisation window adds. At the longest wavelength, at most this share of its variance
# may be the window's. Then an order keeps its width to 3 % and its peak to 5 %.
WINDOW_SHARE = 2 / 3
# This share of a kernel's variance is always applied, so that the bins of a spectrum leave no gaps. A bake's texels
# reach it beyond 700 nm only.
_LEAST_LEFT = 0.2
# The thesis's coherence length, which is the default of the patch model.
THESIS_COHERENCE_M = 65e-6


def kernel_sigma(coherence_length_m: float) -> float:
    """The kernel's standard deviation sigma_b in (u, v) for a coherence length in metres."""
    return REFERENCE_WAVELENGTH_M / (2 * math.pi * math.sqrt(2) * coherence_length_m / 4)


def coherence_length(sigma_b: float) -> float:
    """The coherence length in metres of a kernel of standard deviation sigma_b in (u, v); inverts kernel_sigma."""
    return kernel_sigma(1.0) / sigma_b


def kernel_left(sigma: float, held: float) -> float:
    """The standard deviation of the kernel that widens a Gaussian of standard deviation `held` to sigma.

    Its variance is at least the share _LEAST_LEFT of sigma's."""
    return math.sqrt(max(sigma**2 - held**2, _LEAST_LEFT * sigma**2))


def coherence_areas(size_m: tuple[float, float], coherence_length_m: float, profiles_m: float = 0.0) -> float:
    """The number of coherence areas over which scans average.

    size_m is the size (Ly, Lx) of a scan in metres. profiles_m is the total length in metres of profiles, scans of one
    line that know the heights along one direction only. Two windows count as separate areas if they are at least
    sqrt(2) sigma_s apart: at that shift the square of their overlap has fallen to 1 / e."""
    shift = math.sqrt(2) * coherence_length_m / 4
    return size_m[0] * size_m[1] / shift**2 + profiles_m / shift


def longest_averaging_length(area_m2: float, profiles_m: float = 0.0) -> float:
    """The longest coherence length in metres at which scans average MINIMUM_AREAS coherence areas.

    area_m2 is the scans' total area in square metres, profiles_m the total length in metres of scans of one line."""
    half = profiles_m / 2
    shift = (half + math.sqrt(half**2 + MINIMUM_AREAS * area_m2)) / MINIMUM_AREAS
    return 4 * shift / math.sqrt(2)


def narrowest_averaging_kernel(size_m: tuple[float, float]) -> float:
    """The least sigma_b at which a scan of size (Ly, Lx) metres averages MINIMUM_AREAS coherence areas."""
    return kernel_sigma(longest_averaging_length(size_m[0] * size_m[1]))
