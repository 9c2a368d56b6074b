# SPDX-License-Identifier: GPL-3.0-or-later
"""The random numbers of a material as Cycles draws them: shown as colours on a plane, one sample per pixel.

All use one seed, so a test of one in a thousand, or of five standard deviations, always gives the same result.
"""

from itertools import combinations, product
from statistics import NormalDist

import bpy
import numpy as np
import pytest

from precompute.colour.observer import wavelength_quantiles
from precompute.optics.coherence import REFERENCE_WAVELENGTH_M
from precompute.table import sample_set
from tests.precompute.chi_square import LIMIT, equal_cells, unlikeliness

PIXELS = 256
# Added to the shown values, so that no light is negative. It rounds by 5e-7.
OFFSET = 8.0
# Five standard deviations of the correlation of PIXELS^2 pairs.
FAR = 5 / PIXELS


@pytest.fixture
def drawn(stage, skin):
    """The sample set, and the pictures (PIXELS, PIXELS) of u, v, the wavelength over the set's, and two normals."""
    path = sample_set.path_beside(skin[0])
    found, layout = sample_set.read(path)[0], sample_set.read_header(path)[0]
    direct = stage.addon.direct_response
    image = direct.load_atlas(path, half=True, alpha="CHANNEL_PACKED")
    nodes = direct.SampleSetNodes(image, (layout,), direct.wavelengths_image("D65", layout.wavelength))
    material, tree = stage.material("Drawn")
    draw = nodes.add_to(tree, tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"]))
    output = tree.node("ShaderNodeOutputMaterial")
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.context.object.data.materials.append(material)
    stage.camera((0.3, -0.2, 2), (0, 0, 0), ortho=0.1)
    pictures = []
    for shown in (tree.vector(*draw.q, draw.wavelength), tree.vector(*draw.normals, 0.0)):
        tree.tree.links.new(tree.emission(shown + (OFFSET, OFFSET, OFFSET), 1.0).socket, output.inputs["Surface"])
        pictures.append(stage.rgb("cycles", PIXELS) - OFFSET)
    return found, [*np.moveaxis(pictures[0], -1, 0), *np.moveaxis(pictures[1][..., :2], -1, 0)]


def cells_of(values, edges):
    """For each value the number of the cell, between edges, that contains it."""
    return np.searchsorted(edges, np.ravel(values))


def equal_edges(values, cells):
    """Edges (cells - 1,) between cells of equally many values, midway between values."""
    ordered = np.sort(values)
    at = np.arange(1, cells) * len(values) // cells
    return (ordered[at - 1] + ordered[at]) / 2


def test_texels_are_equally_likely(drawn):
    """A draw is the frequency of a texel, and occurs in proportion to the texels that hold this frequency."""
    found, (u, v, *_) = drawn
    texels = np.round(found.q.reshape(-1, 2).T * REFERENCE_WAVELENGTH_M, 5)
    axes = [np.unique(each) for each in texels]

    def frequencies(*uv):
        """The number of each pixel's or texel's frequency, and the largest distance from it."""
        near = [cells_of(each, (axis[1:] + axis[:-1]) / 2) for each, axis in zip(uv, axes, strict=True)]
        off = [np.abs(np.ravel(each) - axis[at]).max() for each, axis, at in zip(uv, axes, near, strict=True)]
        return near[0] * len(axes[1]) + near[1], max(off)

    held, _ = frequencies(*texels)
    seen, off = frequencies(u, v)
    assert off < 1e-5  # the rounding of texels here; frequencies are a hundred times farther apart
    share, counts = (np.bincount(each, minlength=len(axes[0]) * len(axes[1])) for each in (held, seen))
    assert not counts[share == 0].any()
    cells = equal_cells(share[share > 0], 256)
    counts, share = (np.bincount(cells, each[share > 0]) for each in (counts, share))
    assert len(share) > 100
    assert unlikeliness(counts, share * (u.size / texels.shape[1])) < LIMIT


def test_wavelengths_are_equally_likely(drawn):
    """512 wavelengths, 16 per cell."""
    wavelength = drawn[1][2]
    edges = equal_edges(wavelength_quantiles(512) / REFERENCE_WAVELENGTH_M, 32)
    counts = np.bincount(cells_of(wavelength, edges), minlength=32)
    assert unlikeliness(counts, np.full(32, wavelength.size / 32)) < LIMIT


def test_normals_are_normal(drawn):
    """Both are, including their tails. No number exceeds 5.8: the logarithm is of at least 2^-24."""
    edges = [NormalDist().inv_cdf(each / 64) for each in range(1, 64)]
    edges = [NormalDist().inv_cdf(1e-3), *edges, NormalDist().inv_cdf(1 - 1e-3)]
    shares = np.diff([0.0, *map(NormalDist().cdf, edges), 1.0])
    for normal in drawn[1][3:]:
        assert np.abs(normal).max() < 5.8
        assert unlikeliness(np.bincount(cells_of(normal, edges), minlength=66), shares * normal.size) < LIMIT


def test_numbers_of_a_draw_are_independent(drawn):
    """For each pair of numbers, in 8 x 8 cells; except u and v, which a texel draws together."""
    cells = [np.searchsorted(np.quantile(each, np.arange(1, 8) / 8), each.ravel()) for each in drawn[1]]
    u, v, *others = (np.unique(each, return_inverse=True)[1] for each in cells)
    for one, other in [*combinations(others, 2), *product((u, v), others)]:
        counts = np.zeros((one.max() + 1, other.max() + 1))
        np.add.at(counts, (one, other), 1)
        wanted = counts.sum(axis=0) * counts.sum(axis=1)[:, None] / counts.sum()
        assert unlikeliness(counts, wanted, freedom=one.max() * other.max()) < LIMIT


def test_pixels_draw_independently(drawn):
    for one in drawn[1]:
        for other in drawn[1]:
            for far, near in ((one[:, 1:], other[:, :-1]), (one[1:], other[:-1]), (one[1:, 1:], other[:-1, :-1])):
                assert abs(np.corrcoef(far.ravel(), near.ravel())[0, 1]) < FAR
