# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a bake: its kernel, wavelengths, terms in w and texels, and the memory and time that it will take.

ensemble.py makes the plan (patch.py under the patch model), with the number of transforms in s from spectra/series.py.
levels_and_basis.py may then combine its terms in w into fewer.

The resolution that a surface needs for a colour error dE00 is measured: its terms in w, and its texels per kernel
width. Bounds would cover the worst case: ideal line gratings, whose orders are as sharp as the kernel, and reliefs with
as much light at full depth as elsewhere. Therefore terms and texels are measured, on about twenty small patches of
(u, v). Some patches are where the light is. The others are near the zero order, where a deep relief's light changes
fastest with w. The light of a patch is computed at random places in two ways and compared: as the exact sum over the
bins, and as a reading, by cubic B-splines, of a small lattice of texels.

The constants of the estimates were measured on two cores of a server, on pictures of 512 to 1024 pixels that are 40 to
200 um wide and 0.3 to 5 um high. The estimated memory is 1.5 to 2.4 times the measured one. The time is right to a
factor of two there, and scales with the speed of other machines."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.failure import GratingError
from ..base.machine import in_words, refuse_beyond_memory
from ..base.progress import Progress
from ..colour.illuminants import has_bands, line_of
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths, spectral_weights, white_xyz
from ..maths import bspline, chebyshev
from ..measure.errors import worst_exposure
from ..optics import coherence
from ..optics.region import Region
from ..reflectance.matter import DIELECTRIC, Matter, reflectance_at
from ..spectra.series import KERNEL_REACH, SpectrumSeries, Work
from ..surface.relief import SMALLER, Relief
from ..table.atlas import LARGEST_STORED, STRIP_ROWS, Layout
from ..table.blur_levels import BYTES_PER_TEXEL, TILE_PADDING, cell_for, grid
from ..table.table import ZERO_ORDER_SAMPLES, held_region
from .needs import Needs
from .request import BakeRequest


@dataclass(frozen=True)
class Plan:
    """A bake's spectra and resolution.

    ensemble     the series of each scan; the mean of their spectra is baked
    wavelengths  in metres, ascending
    sigma_b      the standard deviation of the kernel in (u, v)
    texel        the step of u and v per texel
    axes         v and u at the texels' centres
    terms        the number of Chebyshev terms in w
    w_range      the range of w
    precision    the kind of float that holds the terms well enough in a file
    matter       what the surface is made of; the table of a dielectric does not hold its reflectance
    largest_albedo   the number, at least 1, by which the light is divided (largest_albedo.py)"""

    ensemble: tuple[SpectrumSeries, ...]
    wavelengths: np.ndarray
    sigma_b: float
    texel: float
    axes: tuple[np.ndarray, np.ndarray]
    terms: int
    w_range: tuple[float, float]
    precision: type[np.floating]
    matter: Matter = Matter(DIELECTRIC)
    largest_albedo: float = 1.0

    @property
    def holds_reflectance(self) -> bool:
        """Whether the table holds its matter's reflectance."""
        return self.matter.baked

    @property
    def region(self) -> Region:
        """The region of (u, v) that the table holds."""
        return held_region(self.axes)

    @property
    def texels_per_sigma(self) -> float:
        """Texels per standard deviation of the kernel."""
        return self.sigma_b / self.texel


# The least and greatest number of texels a side of a whole table. A plan with a finer table is refused.
RESOLUTION_MIN, RESOLUTION_MAX = 64, 2048
# The greatest number of bytes of a bake in Blender if no coherence length is requested.
DEFAULT_BYTES = 128 << 20
# Texels per standard deviation of the kernel that keep a dE00 of 1 on any surface, ideal line gratings included
# (docs/data_flow.md).
TEXELS_ALWAYS = 1.2


def texel_size(resolution: int) -> float:
    """The step of u per texel, for a tile of `resolution` texels a side.

    The centres of its inner texels reach from -2 to 2."""
    return 4 / (resolution - 2 * TILE_PADDING - 1)


def resolution_for(sigma_b: float, texels_per_sigma: float) -> int:
    """Texels a side of the coarsest whole table that has `texels_per_sigma` texels per kernel sigma_b.

    The number is even, and at least RESOLUTION_MIN."""
    count = math.ceil(4 * texels_per_sigma / sigma_b - 1e-9) + 1 + 2 * TILE_PADDING
    return max(RESOLUTION_MIN, count + count % 2)


def blender_bytes(terms: int, tile: tuple[int, int], sigma_b: float, *, triples: int = 1) -> int:
    """Bytes of a table's atlas in Blender. `tile` is rows and columns of a tile of blur level 0, `triples` the number
    of channels over 3."""
    inner_rows, inner_columns = (n - 2 * TILE_PADDING for n in tile)
    rows, columns = cell_for(terms * triples, (inner_rows, inner_columns), sigma_b).size
    width_min = ZERO_ORDER_SAMPLES + 1
    down, across = grid(terms * triples, (rows, columns), width_min=width_min)
    height = down * rows + STRIP_ROWS * triples
    return BYTES_PER_TEXEL * height * max(across * columns, width_min)


def texel_middles(low: float, high: float, texel: float) -> np.ndarray:
    """The centres of the texels from low to high, and of TILE_PADDING more texels at each end.

    If low and high are not a whole number of texels apart, the outer centres exceed them by equal amounts."""
    count = math.ceil((high - low) / texel - 1e-9) + 1 + 2 * TILE_PADDING
    return (low + high) / 2 + (np.arange(count) - (count - 1) / 2) * texel


# The refractive index of films that light crosses without being absorbed, at most.
_FILM_INDEX = 2.5


def wavelengths_of(sigma_b: float, request: BakeRequest) -> np.ndarray:
    """The wavelengths (n,) in metres that a request's table sums: those of bake_wavelengths that its illuminant has."""
    reach, light = request.needs.region.reach, request.illuminant
    steps = len(bake_wavelengths(sigma_b, request.delta_e, reach, illuminant=light)) - 1
    films_m = sum(layer.thickness_nm for layer in request.matter.layers) * 1e-9
    # With this many steps per unit of the logarithm, neighbours are an eighth of the films' finest fringe apart: the
    # phase of a round trip is at most 4 pi n thickness / wavelength, with n up to _FILM_INDEX.
    steps_per_log = 16 * _FILM_INDEX * films_m / WAVELENGTH_MIN_M
    steps = max(steps, math.ceil(math.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) * steps_per_log))
    return seen_wavelengths(np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, steps + 1), light)


def bake_wavelengths(
    sigma_b: float, delta_e: float = 1.0, reach: float = 2.0, *, illuminant: str = "D65"
) -> np.ndarray:
    """Wavelengths (n,) in metres, equally spaced in their logarithm.

    At |u| = reach, an order moves by f sigma_b from one wavelength to the next. A sum of Gaussians at this spacing is
    flat to 2 exp(-2 pi^2 / f^2) (Poisson's formula). f is chosen so that this is 0.1 % for a dE00 of 1, and in
    proportion for another dE00. The colour matching functions need at least 80 steps.

    Under an illuminant of narrow bands, an order's light at a band is interpolated between two wavelengths. Cubic
    convolution of a Gaussian is off by 0.4 % of its peak at half a standard deviation, in proportion to the spacing's
    third power. So f is a half for a dE00 of 1; a quarter as much, at |u| = reach / 2, is off by 0.04 %."""
    spacing = math.pi * math.sqrt(2 / math.log(2 / min(1e-3 * delta_e, 0.1)))
    if has_bands(illuminant):
        spacing = min(spacing, 0.5 * min(delta_e, 3.0) ** (1 / 3))
    step = min(spacing * sigma_b / reach, np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / 80)
    count = int(np.ceil(np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / step)) + 1
    return np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count)


# Bytes per byte of the series, per bin of a transform, per transform (the probe), and constant (tables).
_PER_SERIES_BYTE, _PER_FINE_BIN, _PER_TRANSFORM, _ALWAYS = 3.6, 16, 4 << 20, 100 << 20
# Seconds per bin, transform, node of w (about as many as transforms) and wavelength; and constant.
_SECONDS_EACH, _SECONDS_ALWAYS = 3e-10, 2.0


def expected_bytes(work: Work) -> float:
    """The peak memory that a bake needs from its first transform on, in addition to the memory it already has."""
    series = 4 * work.transforms * work.bins
    return _PER_SERIES_BYTE * series + _PER_FINE_BIN * work.fine_bins + _PER_TRANSFORM * work.transforms + _ALWAYS


def expected_seconds(work: Work, wavelengths: int) -> float:
    """The time of a bake in seconds."""
    return _SECONDS_ALWAYS + _SECONDS_EACH * wavelengths * work.transforms**2 * work.bins


def tell(work: Work, wavelengths: int, *, scans: int, progress: Progress) -> None:
    """Report to `progress` the expected memory and time of a bake of `scans` scans, all like the first.

    Raises GratingError if the memory is more than half of the free memory."""
    needed, seconds = scans * expected_bytes(work), scans * expected_seconds(work, wavelengths)
    refuse_beyond_memory(needed, "the bake", SMALLER)
    duration = f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
    progress(f"expects {in_words(needed)} and about {duration}", 0.0)


def expected_table_bytes(layout: Layout, needs: Needs) -> tuple[int, int]:
    """Estimate a table's bytes in Blender if it holds only the needs, from the layout of a whole table of the same
    surface; returns them and the whole table's bytes.

    The tiles are cropped to the region. Their texels grow with the kernel if the scene's lights and pixels are wider
    than it. Of the functions of w, two are a constant and a slope; the number of the others is taken as proportional to
    the range of w."""
    sigma_b = max(layout.sigma_b, needs.kernel)
    texel = layout.texel * sigma_b / layout.sigma_b
    tile = tuple(len(texel_middles(*side, texel)) for side in (needs.region.v, needs.region.u))
    side = math.ceil(4 / texel - 1e-9) + 1
    low, high = needs.w
    terms = min(layout.terms, 2 + round((layout.terms - 2) * (high - low) / 2))
    rows, columns = (count - 2 * TILE_PADDING for count in tile)
    spacing = layout.spacing
    cell = cell_for(
        terms, (rows, columns), sigma_b, whole=(side, side), spacings=(spacing,),
        coarser=layout.level_coarser / spacing.stretch,
    )  # fmt: skip
    width_min = layout.zero_order_samples + 1
    down, across = grid(terms, cell.size, width_min=width_min)
    width = max(across * cell.size[1], width_min)
    texels = (down * cell.size[0] + layout.strip_rows) * width
    return BYTES_PER_TEXEL * texels, BYTES_PER_TEXEL * layout.width * layout.height


# The error of a cubic reading falls as the fourth power of the texels per standard deviation of the kernel. It is
# measured at _TEXELS_MEASURED. The lattice of a patch has _LATTICE texels along each side. It is read at _PLACES places
# along each axis, within its three middle cells.
_TEXELS_MEASURED, _LATTICE, _PLACES = 1.0, 6, 5
# The range of texels per standard deviation in which the fourth power holds. A reading of a Gaussian is off by 1.8 % of
# the peak at 1 texel, by 3.4 % at 0.9 texels and by 7.7 % at 0.8 texels, where the fourth power predicts only 2.7 % and
# 4.4 %: there the kernel that is sampled, sqrt(sigma^2 - texel^2 / 3), is so narrow that it falls between the texels.
# Above 1 texel the error falls slightly faster. The rounding of half floats shows before 4 texels.
TEXELS_MIN, TEXELS_MAX = 0.9, 4.0
# Shares of the requested dE00 for reading, truncated terms and half floats. The share of reading also keeps the error
# of luminance below the 1 % that belongs to a dE00 of 1. With a share of 0.75 it was too large for some surfaces, such
# as sample:elaphe, which had to be baked twice.
_READING_SHARE, _TERMS_SHARE, _HALVES_SHARE = 0.55, 0.25, 0.1
# Number of patches where the light is, and near the zero order.
_PATCHES_LIT, _PATCHES_INNER = 16, 5
# The least number of nodes of w, if the table holds a reflectance: it may change faster with w than the relief's light.
_NODES_OF_REFLECTANCE = 24
# A patch where the light is has its centre at a bin drawn in proportion to its power, moved along each axis by a random
# shift of this many standard deviations of the kernel. A reading errs most on an order and on its flanks.
_FLANK = 0.5


@dataclass(frozen=True)
class Probe:
    """The exact light on the patches, and a cubic reading of it.

    truth    (count, places, 3), exact scattered XYZ over w^2 at `count` Chebyshev nodes of w
    reading  (count, places, 3), scattered XYZ over w^2 at the same nodes and places, read from lattices of texels
    real     (count, places), whether some pair of directions reaches the place at the node's w
    white    (3,), XYZ of the illuminant"""

    truth: np.ndarray
    reading: np.ndarray
    real: np.ndarray
    white: np.ndarray

    def texels_per_sigma(self, delta_e: float) -> float:
        """The texels per standard deviation of the kernel that a dE00 of delta_e (99th percentile) needs."""
        excess = self._p99(self.reading) / (_READING_SHARE * delta_e)
        return float(np.clip(_TEXELS_MEASURED * excess**0.25, TEXELS_MIN, TEXELS_MAX))

    def terms(self, delta_e: float) -> int:
        """The least number of Chebyshev terms in w whose truncation takes at most its share of a dE00 of delta_e."""
        count = len(self.truth)
        coefficients = self._coefficients()
        for terms in range(2, count):
            if self._p99(self._sum(coefficients[:terms])) <= _TERMS_SHARE * delta_e:
                return terms
        return count

    def halves_do(self, terms: int, delta_e: float) -> bool:
        """Whether the rounding of `terms` terms to half floats takes at most its share of a dE00 of delta_e.

        The terms of a deep relief are large because the relief scatters most at w = 0. At large w the terms nearly
        cancel, and the rounding of half floats remains."""
        coefficients = self._coefficients()[:terms]
        scale = max(np.abs(coefficients).max(), 1e-30) / LARGEST_STORED
        stored = (coefficients / scale).astype(np.float16).astype(float) * scale
        return self._p99(self._sum(stored)) <= (_TERMS_SHARE + _HALVES_SHARE) * delta_e

    def _coefficients(self) -> np.ndarray:
        """Chebyshev coefficients (count, places, 3) of the truth in w."""
        return np.tensordot(chebyshev.coefficients_from_nodes(len(self.truth)), self.truth, axes=1)

    def _sum(self, coefficients: np.ndarray) -> np.ndarray:
        """Sum the first terms at the nodes of w."""
        basis = chebyshev.polynomials(chebyshev.nodes(len(self.truth), -1, 1), len(coefficients))
        return np.tensordot(basis, coefficients, axes=1)

    def _p99(self, answer: np.ndarray) -> float:
        """The 99th percentile of dE00 at real places, at the worst exposure."""
        truth = self.truth[self.real]
        return worst_exposure(truth, answer[self.real], np.ones(len(truth), bool), white=self.white)["p99"]


def probe(ensemble: Sequence[SpectrumSeries], sigma_b: float, lambdas: np.ndarray, *, request: BakeRequest) -> Probe:
    """Measure the mean of the ensemble's spectra under a kernel sigma_b, in the region of (u, v, w) and in the matter
    of a request."""
    rng = np.random.default_rng(0)
    needs, illuminant = request.needs, request.illuminant
    centres = _patch_centres(ensemble[0], sigma_b, needs, rng=rng, line_m=line_of(illuminant))
    texel = sigma_b / _TEXELS_MEASURED
    lattice = (np.arange(_LATTICE) - (_LATTICE - 1) / 2) * texel
    places = np.sort(rng.uniform(lattice[1], lattice[-2], (2, len(centres), _PLACES)), axis=-1)
    at = [np.concatenate([np.broadcast_to(lattice, (len(centres), _LATTICE)), places[k]], axis=1) for k in (0, 1)]
    v, u = (centres[:, k, None] + at[k] for k in (0, 1))
    # The texels' kernel is narrower, as in the bake: reading the texels widens it to sigma_b.
    sigma = np.repeat([math.sqrt(sigma_b**2 - bspline.VARIANCE * texel**2), sigma_b], [_LATTICE, _PLACES])
    count = max(len(series.amplitude) for series in ensemble)
    if request.matter.baked:
        count = max(count, _NODES_OF_REFLECTANCE)
    w = chebyshev.nodes(count, *needs.w)
    reflectance = reflectance_at(request.matter, lambdas, (u[:, None], v[:, :, None], w[:, None, None, None]))
    xyz = np.zeros((count, *v.shape, u.shape[1], 3))
    for k, (lam, weight) in enumerate(zip(lambdas, spectral_weights(lambdas, illuminant), strict=True)):
        density = np.mean([_density(series, v, u, w, lam, sigma) for series in ensemble], axis=0)
        xyz += (density * reflectance(k))[..., None] * weight
    truth = xyz[:, :, _LATTICE:, _LATTICE:]
    reading = _read(xyz[:, :, :_LATTICE, :_LATTICE], places[0] / texel, places[1] / texel)
    v, u = v[:, _LATTICE:, None], u[:, None, _LATTICE:]
    real = w[:, None, None, None] ** 2 + (v**2 + u**2) <= 4
    return Probe(
        truth.reshape(count, -1, 3), reading.reshape(count, -1, 3), real.reshape(count, -1), white_xyz(illuminant)
    )


def _patch_centres(
    series: SpectrumSeries, sigma_b: float, needs: Needs, *, rng: np.random.Generator, line_m: float | None
) -> np.ndarray:
    """Centres (n, 2) of the patches, as (v, u). `line_m` is the wavelength of a laser's line."""
    radius = np.exp(rng.uniform(math.log(2 * sigma_b), math.log(max(0.4, 3 * sigma_b)), _PATCHES_INNER))
    turn = rng.uniform(0, 2 * np.pi, _PATCHES_INNER)
    found = [radius[:, None] * np.column_stack([np.sin(turn), np.cos(turn)])]
    whole = (slice(None), slice(None))
    each = 4
    for _ in range(_PATCHES_LIT // each):
        lam, w = rng.uniform(450e-9, 650e-9), rng.uniform(*needs.w)
        lam = line_m or lam
        power = np.maximum(series.mixed(series.weights(np.array([w / lam])), whole)[:, 0], 0)
        cumulative = np.cumsum(power, dtype=float)
        if cumulative[-1] > 0:
            bins = np.searchsorted(cumulative, rng.random(each) * cumulative[-1])
            row, col = np.unravel_index(np.minimum(bins, power.size - 1), power.shape)
            middle = lam * np.column_stack([series.grid.q_y[row], series.grid.q_x[col]])
            found.append(middle + _FLANK * sigma_b * rng.standard_normal(middle.shape))
    centres = np.concatenate(found)
    low, high = zip(needs.region.v, needs.region.u, strict=True)
    return np.clip(centres, low, high)


def _density(
    series: SpectrumSeries, v: np.ndarray, u: np.ndarray, w: np.ndarray, lam: float, sigma: np.ndarray
) -> np.ndarray:
    """Scattered light over w^2 (len(w), patches, n, n) of one wavelength at each pair of a v and a u of a patch; both
    (patches, n).

    `sigma` (n,) is the standard deviation of the kernel at each v and each u."""
    left = np.array([series.kernel_left(each, lam) for each in sigma])
    rows, row_kernel = _kernels(series.grid.q_y, v, lam, left[:, 0])
    cols, col_kernel = _kernels(series.grid.q_x, u, lam, left[:, 1])
    bins = series.scattered_over_s2[:, rows[:, :, None], cols[:, None, :]]
    blurred = row_kernel @ bins @ col_kernel.transpose(0, 2, 1)
    return np.tensordot(series.weights(w / lam) / lam**2, blurred, axes=1)


def _kernels(q: np.ndarray, at: np.ndarray, lam: float, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices (patches, m) of the bins around each patch, and their kernel weights (patches, n, m) at `at`."""
    if len(q) == 1:
        index = np.zeros((len(at), 1), int)
    else:
        middle = (at.min(axis=1) + at.max(axis=1)) / 2
        reach = (np.ptp(at, axis=1).max() / 2 + KERNEL_REACH * sigma.max()) / lam
        half = math.ceil(reach / (q[1] - q[0]))
        index = np.searchsorted(q, middle / lam)[:, None] + np.arange(-half, half + 1)
    inside = (index >= 0) & (index < len(q))
    index = np.clip(index, 0, len(q) - 1)
    distance = (at[:, :, None] - lam * q[index][:, None, :]) / sigma[:, None]
    near = inside[:, None, :] & (np.abs(distance) <= KERNEL_REACH)
    kernel = near * np.exp(-0.5 * distance**2) / (math.sqrt(2 * math.pi) * sigma[:, None])
    return index, kernel.astype(np.float32)


def _read(texels: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Read lattices (k, patches, rows, columns, 3) of texels at each pair of a y and an x of a patch.

    y and x (patches, n) count in texels from the centre of the lattice. Returns (k, patches, n, n, 3)."""
    shares = [_shares(each + (_LATTICE - 1) / 2) for each in (y, x)]
    return np.einsum("pij,kpjlc,pml->kpimc", shares[0], texels, shares[1], optimize=True)


def _shares(x: np.ndarray) -> np.ndarray:
    """Weights (patches, n, _LATTICE) of a lattice's texels in readings at x (patches, n), in texels from the first."""
    first, weights = bspline.taps(x, _LATTICE)
    out = np.zeros((*x.shape, _LATTICE))
    for k, weight in enumerate(weights):
        np.put_along_axis(out, (first + k)[..., None], weight[..., None], axis=-1)
    return out


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
        f"too fine for the largest table at a dE00 of {delta_e:g}",
        f"ask for at most {math.floor(longest * 1e6)} um",
    )
