# SPDX-License-Identifier: GPL-3.0-or-later
"""The material's *Roughness*, a blur, against the facets that it stands for.

    ./dev bench roughness [--json FILE|-]

A rough skin is a surface of facets, each with the relief on it. Their slopes have Beckmann's distribution, with alpha
the square of the roughness. A facet shows the diffraction of its own frame: other angles, another w, another tangent.
The material instead blurs the table, as if all facets shared the frame of the whole surface. The benchmark draws pairs
of directions by the light that the material sends, and compares it there with the mean over facets, without shadows
between facets. The mirror image, whose width is the lamp's, is left out. Errors are CIEDE2000, where the brightest
hundredth of the pairs is white or brighter.
"""

from dataclasses import asdict, dataclass

import numpy as np

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import delta_e_2000, lab
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import make_sample
from precompute.table.radiance import Skin, reflected_xyz
from precompute.table.table import Table

from ..study.pages import table
from . import report
from .hemisphere import without_mirror

SURFACES = ("elaphe", "xenopeltis", "blazed")
ROUGHNESSES = (0.1, 0.25, 0.4)
# Pairs of directions that are tried, and pairs that are drawn from them.
_TRIED, _DRAWN = 20_000, 400
# Rings of slopes, and slopes in each ring.
_FACETS = 24
# The exposure: the percentile of the luminance that is shown as white.
_WHITE = 99
# The least cosine of both directions. Facets hide each other towards grazing light.
_COSINE_MIN = 0.3


@dataclass(frozen=True)
class Row:
    """CIEDE2000 of a surface at a roughness: median and 95th percentile. `light` is the material's light over the
    facets'."""

    surface: str
    roughness: float
    median: float
    p95: float
    light: float


def slopes(roughness: float) -> np.ndarray:
    """Slopes (n, 2) of Beckmann's distribution, of equal weight: their radius has the distribution 1 - exp(-s^2 / a^2)
    for a = roughness^2."""
    share = (np.arange(_FACETS) + 0.5) / _FACETS
    radius = roughness**2 * np.sqrt(-np.log1p(-share))
    # A turn by the golden ratio from ring to ring.
    turn = 2 * np.pi * (share[:, None] + np.arange(_FACETS) * (np.sqrt(5) - 1) / 2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1).reshape(-1, 2)


def of_facets(baked: Table, wi: np.ndarray, wr: np.ndarray, roughness: float) -> np.ndarray:
    """The radiance (n, 3) in XYZ under unit irradiance of facets, for unit vectors (n, 3).

    A facet with slopes (a, b) has the normal m along (-a, -b, 1), and the tangent along (1, 0, a). It takes the share
    (wr.m) / ((n.wr) (n.m)) of the view."""
    total = np.zeros((len(wi), 3))
    chosen = slopes(roughness)
    for a, b in chosen:
        normal = np.array([-a, -b, 1]) / np.sqrt(1 + a * a + b * b)
        tangent = np.array([1, 0, a]) / np.sqrt(1 + a * a)
        frame = np.stack([tangent, np.cross(normal, tangent), normal])
        own_i, own_r = wi @ frame.T, wr @ frame.T
        lit = np.flatnonzero((own_i[:, 2] > 0) & (own_r[:, 2] > 0))
        share = own_r[lit, 2] / (wr[lit, 2] * normal[2])
        total[lit] += share[:, None] * reflected_xyz(baked, own_i[lit], own_r[lit])
    return total / len(chosen)


def row_of(surface: str, baked: Table, roughness: float) -> Row:
    """Compare the blur with the facets."""
    rng = np.random.default_rng(0)
    cosine = np.sqrt(rng.uniform(_COSINE_MIN**2, 1, (2, _TRIED)))
    turn, sine = 2 * np.pi * rng.random((2, _TRIED)), np.sqrt(1 - cosine**2)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    shown = reflected_xyz(baked, wi, wr, skin=Skin(roughness=roughness))
    weight = np.maximum(shown[:, 1], 0)
    drawn = rng.choice(_TRIED, _DRAWN, p=weight / weight.sum())
    true = of_facets(baked, wi[drawn], wr[drawn], roughness)
    level = np.percentile(true[:, 1], _WHITE)
    errors = delta_e_2000(*(lab(colours / level, white_xyz()) for colours in (true, shown[drawn])))
    # The pairs are drawn by the material's light, so the mean of the ratios is the ratio of all light.
    light = 1 / np.mean(true[:, 1] / shown[drawn, 1])
    return Row(surface, roughness, float(np.median(errors)), float(np.percentile(errors, 95)), float(light))


def main(argv: list[str] | None = None) -> None:
    """Print a table of the surfaces at each roughness."""
    parser = OneLineParser(prog="./dev bench roughness", description=__doc__.splitlines()[0])
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    rows = []
    for surface in SURFACES:
        baked = without_mirror(bake(prepare(make_sample(surface)), BakeRequest()))
        rows += [row_of(surface, baked, roughness) for roughness in ROUGHNESSES]
    lines = [
        [row.surface, f"{row.roughness:g}", f"{row.median:.1f} / {row.p95:.1f}", f"{row.light:.3f}"] for row in rows
    ]
    report.say(table(["surface", "roughness", "dE00", "light"], lines), arguments.json)
    report.write({"rows": [asdict(row) for row in rows]}, arguments.json)
