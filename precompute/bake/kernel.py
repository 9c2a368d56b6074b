# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the kernel that a bake begins with, from the requested coherence, the scans' size and the scene's needs."""

import math
from collections.abc import Sequence

from ..base.failure import GratingError
from ..colour.observer import WAVELENGTH_MAX_M
from ..optics import coherence
from ..surface.relief import Relief
from .request import BakeRequest
from .resolution import RESOLUTION_MAX, TEXELS_ALWAYS, resolution_for, texel_size
from .terms_and_texels import TEXELS_MAX, TEXELS_MIN

# The least coherence length, a wavelength: its kernel is as wide as the hemisphere.
SHORTEST_COHERENCE_M = coherence.REFERENCE_WAVELENGTH_M


def kernel_for(reliefs: Sequence[Relief], request: BakeRequest) -> float:
    """The standard deviation sigma_b of the kernel in (u, v) that a bake begins with.

    A requested coherence length sets sigma_b. Without one, it is the narrowest kernel that averages enough coherence
    areas of all scans together (optics/coherence.py). It is at least as wide as the scene's lights and pixels, and
    leaves room for the scans' apodisation windows at every wavelength.

    Raises GratingError for a coherence length that is shorter than a wavelength, longer than the scan, or too long for
    any table, and for scans that are too small to average enough areas."""
    coherence_length_m = request.coherence_length_m
    least = max(request.needs.kernel, *(_beside_window(relief) for relief in reliefs))
    held = min(_longest_coherence(relief) for relief in reliefs)
    if coherence_length_m is None:
        length_m = min(coherence.longest_averaging_length(*extent(reliefs)), held)
        if length_m < SHORTEST_COHERENCE_M and held < math.inf:
            raise GratingError(
                "",
                f"the scan, {_sides(reliefs)} um, is too small to average {coherence.MINIMUM_AREAS} coherence areas of "
                "a wavelength",
                "give a larger one, or several",
            )
        return max(coherence.kernel_sigma(max(length_m, SHORTEST_COHERENCE_M)), least)
    asked = f"coherence of {coherence_length_m * 1e6:.3g} um"
    if coherence_length_m < SHORTEST_COHERENCE_M:
        raise GratingError(asked, "shorter than a wavelength", f"ask for at least {SHORTEST_COHERENCE_M * 1e6:g} um")
    if coherence_length_m > held * (1 + 1e-9):
        raise GratingError(
            asked,
            f"longer than the scan, {_sides(reliefs)} um, which would show as one speckle",
            f"ask for at most {math.floor(held * 1e8) / 100:g} um, or give a larger scan",
        )
    sigma_b = max(coherence.kernel_sigma(coherence_length_m), least)
    if resolution_for(sigma_b, TEXELS_MIN) > RESOLUTION_MAX:
        raise too_fine(coherence_length_m, request.delta_e)
    return sigma_b


def extent(reliefs: Sequence[Relief]) -> tuple[float, float]:
    """The total area in square metres of all scans except profiles, and the total length in metres of the profiles.

    A profile is a scan of a single line, constant across its width, so its width does not count."""
    area = sum(math.prod(relief.size_m) for relief in reliefs if 1 not in relief.height_m.shape)
    return area, sum(max(_changing_sides(relief), default=0.0) for relief in reliefs if 1 in relief.height_m.shape)


def _changing_sides(relief: Relief) -> list[float]:
    """The sides, in metres, along which a relief has more than one pixel."""
    return [side for side, count in zip(relief.size_m, relief.height_m.shape, strict=True) if count > 1]


def _beside_window(relief: Relief) -> float:
    """The least sigma_b that a relief's apodisation window leaves room for: 0 if it wraps, else that of a coherence
    length of 0.56 times the scan's shorter side."""
    return WAVELENGTH_MAX_M * max(relief.window_q) / math.sqrt(coherence.WINDOW_SHARE)


def _longest_coherence(relief: Relief) -> float:
    """The longest coherence length of a relief: unlimited if it wraps, or else the scan's shorter side."""
    return math.inf if relief.periodic else min(_changing_sides(relief), default=0.0)


def _sides(reliefs: Sequence[Relief]) -> str:
    """The sides of the scan that limits the coherence length, as text in micrometres."""
    smallest = min(reliefs, key=_longest_coherence)
    return " x ".join(f"{side * 1e6:.3g}" for side in smallest.size_m[::-1])


def too_fine(coherence_length_m: float, delta_e: float) -> GratingError:
    """The error for a coherence length that no table resolves at the requested colour error."""
    texels = min(TEXELS_ALWAYS / delta_e**0.25, TEXELS_MAX)
    longest = coherence.coherence_length(max(texels, TEXELS_MIN) * texel_size(RESOLUTION_MAX))
    return GratingError(
        f"coherence of {coherence_length_m * 1e6:.3g} um",
        f"finer than the largest table holds at a dE00 of {delta_e:g}",
        f"ask for at most {math.floor(longest * 1e6)} um",
    )
