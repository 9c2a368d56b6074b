# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by tests of tables and sample sets: small random tables, a scan, and the sample set of its spectrum."""

import numpy as np
import OpenEXR
import pytest

from precompute.bake.sample_draws import make_sample_set
from precompute.base.failure import GratingError
from precompute.spectra.series import fast_series
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.table.blur_levels import SPACINGS, Cell
from precompute.table.table import Table

S_MAX, GRID_MAX = 2 / 380e-9, 5.6e6
# Values of s to test: from w = 0.4 at 700 nm to w = 2 at 400 nm.
S_SEEN = np.linspace(0.4 / 700e-9, 2 / 400e-9, 9)
SIGMA_B = 0.06
PROVENANCE = {
    "source": "sample:test",
    "model": "ensemble",
    "coherence_um": 12.5,
    "delta_e": {"p99": 0.7},
    "shape": [3, 4],
}


def skin(count=200, scale=40e-9, seed=0):
    """A scan of Gaussian bumps 300 nm wide, with heights of standard deviation `scale`, on pixels of 60 nm."""
    rng = np.random.default_rng(seed)
    q = np.fft.fftfreq(count, 60e-9)
    spectrum = np.fft.fft2(rng.standard_normal((count, count)))
    smooth = np.fft.ifft2(spectrum * np.exp(-(q[:, None] ** 2 + q**2) * (np.pi * 300e-9) ** 2)).real
    return prepare(HeightMap(scale * smooth / smooth.std(), (60e-9, 60e-9), "skin"))


def series_of(relief, finest_kernel=SIGMA_B / 780e-9, tolerance=2e-4):
    return fast_series(relief, GRID_MAX, S_MAX, finest_kernel=finest_kernel, tolerance=tolerance)


def bins_of(found, series):
    """Indices (row, column), each (N, N), of the bins on which a sample set's texels must lie exactly."""
    sides = ((series.grid.q_y, found.q[..., 1]), (series.grid.q_x, found.q[..., 0]))
    index = tuple(np.minimum(np.searchsorted(axis, q), len(axis) - 1) for axis, q in sides)
    for (axis, q), at in zip(sides, index, strict=True):
        np.testing.assert_array_equal(axis[at], q)
    return index


@pytest.fixture(scope="session")
def scan():
    """The series of a scan, its sample set with pieces exact to 1e-5, and the indices (N, N) of its texels' bins."""
    series = series_of(skin())
    found = make_sample_set([series], SIGMA_B, tolerance=1e-5)
    return series, found, bins_of(found, series)


def random_bake(terms=5, resolution=12, samples=20, peak=1.0, *, seed=0, levels=1, spacing=SPACINGS[0]):
    """A table with random tiles of `resolution` texels on the first level: one number, or (rows, columns)."""
    rng = np.random.default_rng(seed)
    tile = np.broadcast_to(resolution, 2)
    cell = Cell((tile[0] - 4, tile[1] - 4), levels, spacing, spacing.stretch)
    sizes = [[n + 4 for n in cell.inner_of(level)] for level in range(levels)]
    tiles, *wider = ((peak * rng.uniform(-1, 1, (terms, *size, 3))).astype(np.float32) for size in sizes)
    texel = 4 / (tile.max() - 5)
    return Table(
        tiles, rng.uniform(0, 1.1, (samples, 3)), 0.04, texel, "D65", wider=tuple(wider), spacing=spacing,
        coarser=cell.coarser,
    )  # fmt: skip


def refusal(path, *readers):
    """The one-line error of each reader, which names the file, the fault and the remedy."""
    lines = set()
    for read in readers:
        with pytest.raises(GratingError) as caught:
            read(path)
        lines.add(str(caught.value))
    (line,) = lines
    assert line.startswith(f"{path}: ") and "; " in line and "\n" not in line
    return line


def plain_exr(path, image, header=None):
    """Write a picture of channels R, G, B, and A for four channels, as any program might."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(header or {})}
    with OpenEXR.File(header, {"RGBA"[: image.shape[-1]]: np.ascontiguousarray(image)}) as file:
        file.write(str(path))
