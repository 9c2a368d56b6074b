# SPDX-License-Identifier: GPL-3.0-or-later
"""The stack of films against an independent package, tmm by S. J. Byrnes (arXiv:1603.02720)."""

import numpy as np
import pytest

from precompute.reflectance.films import metal_index, stack_reflectance
from precompute.reflectance.matter import parse

tmm = pytest.importorskip("tmm", reason="the package tmm is in the environment py311-bpy45 only")

WAVELENGTHS = np.array([380e-9, 470e-9, 555e-9, 780e-9])
COSINES = np.array([1e-3, 0.1, 0.5, 0.93, 1.0])


def by_tmm(indices, thicknesses_m):
    """The reflectance (n, m) of indices (l + 1, n) for WAVELENGTHS and COSINES."""
    widths = [np.inf, *thicknesses_m, np.inf]
    return np.array(
        [
            [tmm.unpolarized_RT([1, *indices[:, i]], widths, np.arccos(c), wavelength)["R"] for c in COSINES]
            for i, wavelength in enumerate(WAVELENGTHS)
        ]
    )


@pytest.mark.parametrize("seed", range(6))
def test_random_stacks(seed):
    """Even seeds absorb, odd seeds do not."""
    rng = np.random.default_rng(seed)
    count = rng.integers(1, 30)
    indices = rng.uniform(1.2, 2.6, (count + 1, len(WAVELENGTHS))) + 0j
    if seed % 2 == 0:
        indices += 1j * rng.uniform(0, 0.5, indices.shape)
    thicknesses = list(rng.uniform(5e-9, 300e-9, count))
    found = stack_reflectance(WAVELENGTHS, COSINES, indices, thicknesses_m=thicknesses)
    # Both multiply up to 30 matrices; a lossless stack's resonance multiplies rounding by 1e3.
    assert found == pytest.approx(by_tmm(indices, thicknesses), abs=1e-11)


def test_a_metal_under_a_film_under_a_thin_metal():
    matter = parse("chromium/8nm, silica 1.46/260nm, aluminium")
    chromium, aluminium = metal_index("chromium", WAVELENGTHS), metal_index("aluminium", WAVELENGTHS)
    indices = np.stack([chromium, np.full(len(WAVELENGTHS), 1.46), aluminium])
    found = matter.reflectance(WAVELENGTHS, COSINES)
    # As above, with three layers.
    assert found == pytest.approx(by_tmm(indices, [8e-9, 260e-9]), abs=1e-12)


def test_a_periodic_stack_by_its_text():
    matter = parse("6x(1.68+0.03i/80nm, 1.55+0.14i/90nm), 1.56")
    indices = np.repeat(np.array([1.68 + 0.03j, 1.55 + 0.14j] * 6 + [1.56])[:, None], len(WAVELENGTHS), axis=1)
    found = matter.reflectance(WAVELENGTHS, COSINES)
    # As above, with twelve layers.
    assert found == pytest.approx(by_tmm(indices, [80e-9, 90e-9] * 6), abs=1e-12)
