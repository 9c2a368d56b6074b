# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake's results against results recorded with the cache's version. Other machines cache bakes under this version, so
changed results need a new version."""

import json
from pathlib import Path

import numpy as np
import pytest

from precompute.bake import cache
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, sinusoidal
from precompute.table.atlas import pack, unpack

GOLDEN = Path(__file__).with_name("golden.json")


def uneven() -> HeightMap:
    """A surface without symmetry and period, whose pixels are not square: a wave that chirps along x, a slanted one,
    and two bumps, within 200 nm. A sign, swapped axes or half a pixel change its bake."""
    y, x = np.mgrid[0:56, 0:72] + 0.5
    x, y = x / 72, y / 56
    waves = np.sin(17 * x + 9 * x**2) + 0.6 * np.sin(7.3 * x + 13.1 * y + 1)
    wide, narrow = np.exp(-(((x - 0.3) / 0.12) ** 2) - ((y - 0.7) / 0.2) ** 2), np.exp(-((x - 0.8) ** 2 + y**2) / 0.03)
    return HeightMap(40e-9 * (waves + 1.5 * wide + narrow), (110e-9, 90e-9), "uneven")


# Surfaces, and what they are made of.
CASES = {
    "uneven": (uneven, "dielectric"),
    "blazed": (lambda: blazed(periods=4, rows=96), "dielectric"),
    "sinusoidal": (lambda: sinusoidal(periods=3, rows=48), "dielectric"),
    "gold": (lambda: blazed(periods=4, rows=96), "gold"),
}
# Spectra have single precision, whose last digit (6e-8) depends on the processor and on NumPy's version; sums of some
# thousands of them agree to 1e-5. Half floats round a term by at most 2^-11 = 5e-4 of itself. If a last digit changes
# that rounding, the sums over a term's texels hardly change. So each sum may differ by this share of the largest.
ROUNDING = 2e-5


def figures(name: str) -> dict[str, list[float]]:
    """Sums over the contents of the file of a case's bake."""
    surface, matter = CASES[name]
    request = BakeRequest(delta_e=2.0, coherence_length_m=6e-6, matter=parse(matter))
    table = unpack(*pack(bake(prepare(surface()), request)))
    return {
        "shape": list(table.terms.shape),
        "levels": [len(table.levels)],
        "texel": [table.texel, table.sigma_b, *table.first],
        "terms": [float(np.abs(term.astype(float)).sum()) for term in table.terms],
        "wider": [float(np.abs(level.astype(float)).sum()) for level in table.wider],
        "along_u": [_weighted(term, np.linspace(0, 1, term.shape[1])) for term in table.terms],
        "along_v": [_weighted(term, np.linspace(0, 1, len(term))[:, None]) for term in table.terms],
        "zero_order": table.zero_order[::64].astype(float).sum(axis=-1).tolist(),
        "largest_albedo": [table.largest_albedo],
    }


def _weighted(term: np.ndarray, weights: np.ndarray) -> float:
    """The sum over a term with weights that grow along an axis: it notices a mirrored, turned or shifted table."""
    return float((np.abs(term.astype(float)) * weights[..., None]).sum())


@pytest.mark.parametrize("name", CASES)
def test_results_change_only_with_the_version(name):
    golden = json.loads(GOLDEN.read_text())
    found = figures(name)
    told = f"raise cache.BAKE_VERSION and write into {GOLDEN.name}: {json.dumps({name: found})}"
    assert golden["version"] == cache.BAKE_VERSION, f"recorded of another version; {told}"
    assert found.keys() == golden[name].keys()
    for key, recorded in golden[name].items():
        off = ROUNDING * np.max(np.abs(recorded))
        np.testing.assert_allclose(found[key], recorded, rtol=0, atol=off, err_msg=f"{key}: {told}")
