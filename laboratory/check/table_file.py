# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a bake's file, and sums the spectrum of its relief, without the code that makes, packs and reads tables.

The spectrum is summed in cells of frequency, without an FFT or an expansion: the apodised phasor without its mean is
summed against cosines and sines over every pixel, at a list of frequencies.

A surface that wraps has orders at whole multiples of 1 / length, and no light at other frequencies. The spectrum of a
surface that does not wrap is continuous. It is sampled at multiples of 1 / (length + PAD / (2 pi sigma_q)), where
sigma_q is the standard deviation of the applied kernel in cycles per metre. At this spacing the kernel's sum over the
samples is the kernel's integral: blurring a spectrum by the kernel weights the lags of the scan's autocorrelation by a
Gaussian of standard deviation 1 / (2 pi sigma_q). Sampling the spectrum repeats this Gaussian with the period length +
PAD / (2 pi sigma_q), and the repetitions weight the lags as well. The longest lag of the scan, at which the apodised
scan barely overlaps itself, gets a weight of exp(-PAD^2 / 2) from a repetition, all other lags less.

The sums are in single precision. Each rounding is 6e-8 of its number. So the cells share about 1e-14 of the light that
belongs elsewhere.

The tiles of the blur levels are found in the picture by a rule of their own. With r = 1 / sqrt(ratio), each level but
the first has texels `coarser` / r^l times as large as the first level's. The tiles of a term stand side by side on two
shelves. Tile l begins at the rounded-down place A + A (r + r^2 + ... + r^(l-1)) / coarser + 6 l + phase, where A is the
number of inner columns less 1; the first begins at 0. The phase makes the fractions of these places as far from 0 as
possible. The upper shelf begins above the first tile or above the second. This, and the number of tiles on the lower
shelf, are chosen so that the cell is smallest."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from precompute.base.exr_reader import Picture, open_picture
from precompute.base.failure import GratingError
from precompute.base.strict import parse_json
from precompute.colour.channels import channel_count
from precompute.colour.illuminants import is_illuminant
from precompute.optics.region import FARTHEST, Region
from precompute.reflectance.matter import DIELECTRIC, MIRRORING, Matter, parse
from precompute.surface.relief import Relief

# Padding of a scan that does not wrap, in units of 1 / (2 pi sigma_q).
PAD = 3.0
# The kernel is cut at this many standard deviations, where it is exp(-6^2 / 2) = 1.5e-8 of its peak.
KERNEL_REACH = 6.0
# The largest spacing of merged cells, in standard deviations of the kernel.
_MERGED = 1 / 3
# The shares of the light of a cell midway between six cells, by the interpolation of a polynomial through these six.
_SHARES = np.array([3, -25, 150, 150, -25, 3], np.float32) / 256
# Number of values gathered at once, to limit memory.
_GATHERED = 4_000_000


@dataclass(frozen=True)
class Cells:
    """The scattered spectrum in cells of frequency.

    q_y, q_x  the centres (ny,) and (nx,) of the cells, in cycles per metre, ascending
    power     (ny, nx) float32, the share of the light that is scattered into each cell
    window_q  widths (y, x) of the scan's apodisation window, in cycles per metre, which the cells' light already has"""

    q_y: np.ndarray
    q_x: np.ndarray
    power: np.ndarray
    window_q: tuple[float, float]

    def density(self, u: np.ndarray, v: np.ndarray, lam: float, *, sigma_b: float) -> np.ndarray:
        """Density (n,) over (u, v) at places u, v (n,), at the wavelength lam in metres, under a kernel of sigma_b.

        The light of each cell is spread about lam * q as a Gaussian of the rest of the kernel."""
        rows, kernel_y = _near(self.q_y, v, lam, _rest(sigma_b, lam * self.window_q[0]))
        cols, kernel_x = _near(self.q_x, u, lam, _rest(sigma_b, lam * self.window_q[1]))
        found = np.empty(len(u))
        at_once = max(1, _GATHERED // (rows.shape[1] * cols.shape[1]))
        for start in range(0, len(u), at_once):
            part = slice(start, start + at_once)
            along_x = self.power[rows[part, :, None], cols[part, None, :]] @ kernel_x[part, :, None]
            found[part] = (along_x[..., 0] * kernel_y[part]).sum(axis=1)
        return found

    def wide_density(
        self, u: np.ndarray, v: np.ndarray, lam: float, *, sigma: np.ndarray, farthest: float = FARTHEST
    ) -> np.ndarray:
        """The density (n,) under kernels of `sigma` (n,), of the light within |(u, v)| = farthest only: no pair of
        directions shows other light.

        Cells are merged where the kernel is wide against them."""
        cells = replace(self, power=self.power * (self.q_x**2 + self.q_y[:, None] ** 2 <= (farthest / lam) ** 2))
        found = np.empty(len(u))
        for each in np.unique(sigma):
            cells = cells.merged(each / lam)
            of_sigma = sigma == each
            found[of_sigma] = cells._summed(u[of_sigma], v[of_sigma], lam, each)
        return found

    def merged(self, sigma_q: float) -> "Cells":
        """The cells, merged by twos while their spacing stays below _MERGED of a kernel of sigma_q.

        A cell between two that stay gives its light to the three on either side. This is the transpose of interpolating
        the kernel there by the polynomial of degree 5 through six places, which is off by at most h^6 (225 / 64) / 720
        times the kernel's sixth derivative, for places h apart. A Gaussian's sixth derivative is at most 15 / sigma^6
        of its peak. So one merging at h = sigma / 3 is off by 1e-4 of the peak, all of both axes by 2.1e-4, which is a
        dE00 of at most 0.01."""
        q_y, power = _merged_along(self.q_y, self.power, _rest(sigma_q, self.window_q[0]))
        q_x, power = _merged_along(self.q_x, power.T, _rest(sigma_q, self.window_q[1]))
        return replace(self, q_y=q_y, q_x=q_x, power=power.T)

    def _summed(self, u: np.ndarray, v: np.ndarray, lam: float, sigma: float) -> np.ndarray:
        """The density (n,) as a sum over all cells."""
        kernel_y, kernel_x = (
            _gaussian(at[:, None] - lam * q, _rest(sigma, lam * width))
            for at, q, width in zip((v, u), (self.q_y, self.q_x), self.window_q, strict=True)
        )
        return np.einsum("nx,nx->n", kernel_y @ self.power, kernel_x)


def _rest(sigma: float, width: float) -> float:
    """The standard deviation, at least sigma / sqrt(5), that widens a window of this width to a kernel of sigma."""
    return float(np.sqrt(max(sigma**2 - width**2, sigma**2 / 5)))


def _near(q: np.ndarray, places: np.ndarray, lam: float, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n, m) of the frequencies within the kernel's reach of places (n,), and the kernel there."""
    centres = lam * q
    first = np.searchsorted(centres, places - KERNEL_REACH * sigma)
    count = int((np.searchsorted(centres, places + KERNEL_REACH * sigma) - first).max(initial=1))
    index = first[:, None] + np.arange(count)
    inside = index < len(q)
    index = np.minimum(index, len(q) - 1)
    return index, inside * _gaussian(places[:, None] - centres[index], sigma)


def _gaussian(distance: np.ndarray, sigma: float) -> np.ndarray:
    """The normal density of standard deviation sigma at a distance, in single precision."""
    return np.exp(-0.5 * (distance / sigma).astype(np.float32) ** 2) / np.float32(np.sqrt(2 * np.pi) * sigma)


def _merged_along(q: np.ndarray, power: np.ndarray, sigma_q: float) -> tuple[np.ndarray, np.ndarray]:
    """Places q (n,) and their power (n, m), merged as in Cells.merged.

    Each merging adds two places at the lower end and three at the upper."""
    beside = len(_SHARES) // 2
    while len(q) > 1 and 2 * (q[1] - q[0]) <= _MERGED * sigma_q:
        between, step = power[1::2], 2 * (q[1] - q[0])
        power = np.pad(power[::2], [(beside - 1, beside), (0, 0)])
        for k, share in enumerate(_SHARES):
            power[k : k + len(between)] += share * between
        q = q[0] + step * (np.arange(len(power)) - (beside - 1))
    return q, power


def scattered_cells(relief: Relief, s: float, reach: tuple[float, float], *, sigma_q: float) -> Cells:
    """Cells of a relief at s = w / lambda, spaced finely enough for a kernel of sigma_q.

    The cells go up to `reach`, the largest |q_y| and |q_x|. All are in cycles per metre."""
    turns = s * relief.height_m
    phase = (-2 * np.pi * (turns - np.rint(turns))).astype(np.float32)
    parts = np.stack([np.cos(phase), np.sin(phase)])
    mean_y, mean_x = (apodisation**2 / np.sum(apodisation**2) for apodisation in relief.apodisation_axes)
    parts -= (mean_y @ parts @ mean_x)[:, None, None].astype(np.float32)
    parts *= relief.apodisation_axes[0][:, None].astype(np.float32)
    parts *= relief.apodisation_axes[1].astype(np.float32)
    (q_y, step_y), (q_x, step_x) = (_frequencies(relief, axis, reach[axis], sigma_q) for axis in (0, 1))
    waves_y, waves_x = _waves(q_y, relief, 0), _waves(q_x, relief, 1)
    sums = [
        [wave_y.T @ (part @ wave_x) for wave_x, part in zip(waves_x, _halves(along_y, axis=2), strict=True)]
        for wave_y, along_y in zip(waves_y, _halves(parts, axis=1), strict=True)
    ]
    energy = np.prod([np.sum(apodisation**2) for apodisation in relief.apodisation_axes])
    power = _power(sums) * np.float32(np.prod(relief.pixel_size_m) * step_y * step_x / energy)
    return Cells(np.concatenate([-q_y[:0:-1], q_y]), np.concatenate([-q_x[:0:-1], q_x]), power, relief.window_q)


def _frequencies(relief: Relief, axis: int, reach: float, sigma_q: float) -> tuple[np.ndarray, float]:
    """Frequencies from 0 to `reach`, within the Nyquist cell, and their spacing; cycles per metre."""
    length, pixel = relief.size_m[axis], relief.pixel_size_m[axis]
    # A scan of a single line is a profile, constant across its short axis, and needs no padding along that axis.
    if not relief.periodic and relief.height_m.shape[axis] > 1:
        length += PAD / (2 * np.pi * _rest(sigma_q, relief.window_q[axis]))
    most = min(reach * length, (length / pixel - 1) / 2 + 1e-6)
    return np.arange(int(most) + 1) / length, 1 / length


def _halves(parts: np.ndarray, *, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """The sums and differences of the pixels that lie alike on both sides of the middle of an axis, middle first.

    The cosine sums the former and the sine the latter, each over half of the pixels. A pixel in the middle counts
    once."""
    count = parts.shape[axis]
    half = (count + 1) // 2
    beyond = np.moveaxis(parts, axis, 0)[count - half :]
    before = np.moveaxis(parts, axis, 0)[half - 1 :: -1]
    even, odd = beyond + before, beyond - before
    if count % 2:
        even[0] /= 2
    return np.moveaxis(even, 0, axis), np.moveaxis(odd, 0, axis)


def _waves(q: np.ndarray, relief: Relief, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """cos and sin of 2 pi q x (pixels, n) for q (n,), at the pixels of _halves, whose x counts from the middle."""
    count = relief.height_m.shape[axis]
    x = (np.arange(count // 2, count) - (count - 1) / 2) * relief.pixel_size_m[axis]
    turns = np.outer(x, q)
    phase = (2 * np.pi * (turns - np.rint(turns))).astype(np.float32)
    return np.cos(phase), np.sin(phase)


def _power(sums: list[list[np.ndarray]]) -> np.ndarray:
    """|sum of p exp(-2 pi i (q_y y + q_x x))|^2 (2 ny - 1, 2 nx - 1) for both signs of both frequencies.

    p is the summed field, y and x are positions. `sums`: p's real and imaginary part (2, ny, nx) times cosines, then
    sines, along y; in each, along x."""
    (cc, cs), (sc, ss) = [[real + 1j * imaginary for real, imaginary in along_y] for along_y in sums]
    same, opposite = (cc - ss, cs + sc), (cc + ss, cs - sc)
    up_right, down_left = (_squared(same[0] + sign * same[1]) for sign in (-1j, 1j))
    down_right, up_left = (_squared(opposite[0] + sign * opposite[1]) for sign in (-1j, 1j))
    down = np.hstack([down_left[:0:-1, :0:-1], down_right[:0:-1]])
    return np.vstack([down, np.hstack([up_left[:, :0:-1], up_right])])


def _squared(amplitude: np.ndarray) -> np.ndarray:
    return amplitude.real**2 + amplitude.imag**2


# Columns that a tile takes beside the A r^l of its inner texels.
_BESIDE = 6


@dataclass(frozen=True)
class Place:
    """A tile in its cell: its lowest row and leftmost column, and its rows and columns, all with its rim."""

    bottom: int
    left: int
    rows: int
    columns: int


def places_of(
    inner: tuple[int, int], levels: int, *, ratio: float, coarser: float
) -> tuple[list[Place], tuple[int, int]]:
    """The places of all levels' tiles, and rows and columns of the cell, for `inner` rows and columns of level 0."""
    r = ratio**-0.5
    shares = [1.0, *(r**level / coarser for level in range(1, levels))]
    tiles = [[math.ceil((count - 1) * share - 1e-9) + 1 + 2 * _RIM for count in inner] for share in shares]
    begins = [(inner[1] - 1) * math.fsum(shares[:level]) + _BESIDE * level for level in range(levels + 1)]
    phase = _phase([each % 1 for each in begins])
    columns = [math.floor(each + phase) for each in begins]
    shelves = [(shelf, above) for shelf in range(1, levels + 1) for above in range(min(shelf, 2))]
    shelf, above = min(shelves, key=lambda each: math.prod(_size(tiles, columns, *each)))
    up, left = tiles[above][0], columns[shelf] - columns[above]
    places = [
        Place(up * (level >= shelf), columns[level] - left * (level >= shelf), *tiles[level]) for level in range(levels)
    ]
    return places, _size(tiles, columns, shelf, above)


def _phase(fractions: list[float]) -> float:
    """What moves the middle of the widest gap between fractions, around a circle, to 0."""
    ascending = sorted(fractions)
    gaps = [after - before for before, after in zip(ascending, [*ascending[1:], ascending[0] + 1], strict=True)]
    widest = gaps.index(max(gaps))
    return -(ascending[widest] + gaps[widest] / 2) % 1


def _size(tiles: list[list[int]], columns: list[int], shelf: int, above: int) -> tuple[int, int]:
    """Rows and columns of a cell with `shelf` tiles on the lower shelf, and the others above from tile `above` on."""
    if shelf == len(tiles):
        return tiles[0][0], columns[shelf]
    rows = max(tiles[0][0], tiles[above][0] + tiles[shelf][0])
    return rows, max(columns[shelf], columns[above] + columns[-1] - columns[shelf])


FORMAT = 14
# The inner texels of a tile hold the table. _RIM is the number of texels on each side of them for interpolation. _STRIP
# is the number of rows of the zero order's strip for each three channels.
_RIM, _STRIP = 2, 4
_COUNTS = (
    "terms", "levels", "cell_rows", "cell_columns", "inner_rows", "inner_columns", "columns", "rows", "strip_rows",
    "zero_order_samples", "polynomials",
)  # fmt: skip
# The least and the greatest value of each real number of a layout: the sky, kernels up to one that fills it, and scales
# whose largest stored value, 8192 times the scale, fits single precision.
_REALS = {
    "level_ratio": (1.01, 4.0),
    "level_offset": (0.0, 8.0),
    "level_coarser": (1.0, 4.0),
    "texel": (1e-6, 4.0),
    "sigma_b": (1e-6, 1.0),
    "scale": (1e-35, 1e30),
    "u_first": (-16.0, 16.0),
    "v_first": (-16.0, 16.0),
    "w_min": (0.0, 2.0),
    "w_max": (0.0, 2.0),
    "ratio_ior": (1.0, 3.0),
    "plate_ior": (1.0, 3.0),
    "largest_albedo": (1.0, 16.0),
}
# Texels a side of each of a plate's gains, which the check does not measure: that of scattered light, and that of the
# mirror image for each three channels.
_GAINS = 48
# The limits of a material, as in the bake.
_TERMS_MAX, _LEVELS_MAX = 96, 64


@dataclass(frozen=True)
class Table:
    """A bake as in its file. Its channels (colour/channels.py) are XYZ and, for lamps of several spectra, more.

    terms       (K, rows, columns, channels), terms of the channels over w^2; the first axis of a tile runs along +v,
                the second along +u; the outer two texels on every side serve interpolation only
    zero_order  the zero order's channels (n, channels) at equal steps of w from 0 to 2
    ratio_ior   the index of the ratio form, if it holds its matter's reflectance; else 1
    first       (u, v) of the first texel's centre
    texel       distance of the texels in u and v
    w_range     range of w that the terms cover
    sigma_b     standard deviation of the kernel in u and v
    basis       (K, J), each term's function of w as coefficients of Chebyshev polynomials
    record      the header
    wider       the terms on the wider blur levels
    ratio       the variance of a wide level's kernel over that of the level before
    offset      what, added to the variance of each level's kernel over the first's, makes all of them grow by `ratio`
    coarser     the factor by which the texels of the wider levels are larger than they would be for this ratio alone

    The file's terms and zero order are divided by a largest albedo. Those of the table are multiplied by it again.

    Under a plate, u, v, w and sigma_b are those of the directions inside it.
    """

    terms: np.ndarray
    zero_order: np.ndarray
    ratio_ior: float
    first: tuple[float, float]
    texel: float
    w_range: tuple[float, float]
    sigma_b: float
    illuminant: str
    basis: np.ndarray
    record: dict[str, Any]
    wider: tuple[np.ndarray, ...] = ()
    ratio: float = 4.0
    offset: float = 0.0
    coarser: float = 1.0

    @property
    def matter(self) -> Matter:
        """What reflects in the table's light; a mirror, if the table does not hold the reflectance."""
        return parse(self.record["request"]["matter"]) if self.ratio_ior > 1 else MIRRORING

    @property
    def region(self) -> Region:
        """The part of (u, v) that the table covers: from the centre of the first inner texel to that of the last."""
        _, rows, columns, _ = self.terms.shape
        return Region(*(
            (first + _RIM * self.texel, first + (count - 1 - _RIM) * self.texel)
            for first, count in zip(self.first, (columns, rows), strict=True)
        ))  # fmt: skip

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w: float, *, variance: float = 0.0) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u, v (n,): see channels_over_w2."""
        return self.channels_over_w2(u, v, w, variance=variance, channels=3)

    def channels_over_w2(
        self, u: np.ndarray, v: np.ndarray, w: float, *, variance: float = 0.0, channels: int | None = None
    ) -> np.ndarray:
        """All channels, or the first `channels`, of the scattered light over w^2 (n, channels) at u, v (n,).

        Texels are read by cubic B-splines, and functions of w are Chebyshev sums. `variance` is added to the kernel's.
        Between two levels their mixture has the right variance."""
        grown = min(1 + variance / self.sigma_b**2, self.grown(len(self.wider)))
        below = max((level for level in range(len(self.wider)) if self.grown(level) <= grown + 1e-9), default=0)
        low, high = self.grown(below), self.grown(below + 1)
        share = (grown - low) / (high - low)
        found = (1 - share) * self._read(below, u, v, w, channels)
        return found + share * self._read(below + 1, u, v, w, channels) if share > 0 else found

    def grown(self, level: float) -> float:
        """The variance of a level's kernel over that of the first level."""
        return (1 + self.offset) * self.ratio**level - self.offset

    def _read(self, level: int, u: np.ndarray, v: np.ndarray, w: float, channels: int | None) -> np.ndarray:
        """The first channels over w^2 (n, channels) of one blur level."""
        terms, texel = (self.terms, *self.wider)[level][..., :channels], self.texel
        if level:
            texel *= self.coarser * self.ratio ** (level / 2)
        low, high = self.w_range
        angle = math.acos(np.clip((2 * w - low - high) / (high - low), -1, 1))
        basis = self.basis @ np.cos(np.arange(self.basis.shape[1]) * angle)
        # The first inner texel is at the same (u, v) on every level.
        x = (np.clip(u, *self.region.u) - self.region.u[0]) / texel + _RIM
        y = (np.clip(v, *self.region.v) - self.region.v[0]) / texel + _RIM
        found = np.zeros((len(u), terms.shape[-1]))
        for row in (np.floor(y) + k for k in (-1, 0, 1, 2)):
            for column in (np.floor(x) + k for k in (-1, 0, 1, 2)):
                share = cubic_bspline(y - row) * cubic_bspline(x - column)
                texels = terms[:, row.astype(int), column.astype(int)]
                found += share[:, None] * np.tensordot(basis, texels, axes=1)
        return found

    def zero_order_xyz(self, w: np.ndarray | float) -> np.ndarray:
        """The zero order's XYZ (..., 3) at w (...,)."""
        return self.zero_order_channels(w)[..., :3]

    def zero_order_channels(self, w: np.ndarray | float) -> np.ndarray:
        """The zero order's channels (..., channels) at w (...,), by cubic B-splines over the samples.

        Past the last sample, the line through the last two samples is continued."""
        last = len(self.zero_order) - 1
        at = np.asarray(w, float) / 2 * last
        beyond = 2 * self.zero_order[-1] - self.zero_order[-2]
        samples = np.concatenate([self.zero_order, [beyond]])
        found = np.zeros(self.zero_order.shape[-1])
        for each in (np.floor(at) + k for k in (-1, 0, 1, 2)):
            found = found + cubic_bspline(at - each)[..., None] * samples[np.clip(each, 0, last + 1).astype(int)]
        return found

    def candidate(self, u: np.ndarray, v: np.ndarray, w: float) -> tuple[np.ndarray, np.ndarray]:
        """The table as a candidate of measure/errors.py."""
        return self.scattered_over_w2(u, v, w), self.zero_order_xyz(w)


def cubic_bspline(x: np.ndarray) -> np.ndarray:
    """The uniform cubic B-spline at x, from its truncated powers."""
    powers = [math.comb(4, k) * (-1) ** k * np.maximum(x + 2 - k, 0) ** 3 for k in range(5)]
    return sum(powers) / 6


def read_table(path: Path) -> Table:
    """Read the table in a bake's file. Raises GratingError if the file is no bake of the ensemble model."""
    picture = open_picture(path)
    record = parse_json(picture.texts.get("natural_gratings", b"null"), path, "bake it again", part="its header: ")
    if not isinstance(record, dict) or not {"format", "layout", "model"} <= set(record):
        raise GratingError(path, "not a Natural Gratings bake", "give the .exr that `bake` wrote")
    if record["format"] != FORMAT:
        raise GratingError(path, f"made by another version (format {record['format']!r:.20})", "bake it again")
    if record["model"] != "ensemble":
        raise GratingError(
            path, f"holds the {record['model']!r:.20} model, which check cannot measure", "bake the ensemble model"
        )
    fault = _fault_of_layout(record["layout"], picture) or _fault_of_provenance(record)
    if fault:
        raise GratingError(path, f"its header's {fault} is invalid, or does not fit its picture", "bake it again")
    return _table(picture.pixels(), record)


def _fault_of_layout(layout: object, picture: Picture) -> str:
    """The name of a value that no picture of this size can have; "" if there is none."""
    if not isinstance(layout, dict):
        return "layout"
    if not is_illuminant(layout.get("illuminant")):
        return "illuminant"
    triples = _triples(layout)
    for name in _COUNTS:
        if type(layout.get(name)) is not int or not 1 <= layout[name] <= max(picture.shape):
            return name
    for name, (low, high) in _REALS.items():
        if type(layout.get(name)) not in (int, float) or not low <= layout[name] <= high:
            return name
    cell, inner = (tuple(layout[f"{name}_{side}"] for side in ("rows", "columns")) for name in ("cell", "inner"))
    reach = [
        abs(layout[first] + (_RIM + end) * layout["texel"])
        for first, count in zip(("v_first", "u_first"), inner, strict=True)
        for end in (0, count - 1)
    ]
    for name, fits in (
        ("terms", layout["terms"] <= min(_TERMS_MAX, layout["rows"] * layout["columns"] // triples)),
        ("polynomials", layout["polynomials"] <= _TERMS_MAX),
        ("basis", _is_basis(layout.get("basis"), layout["terms"] * layout["polynomials"])),
        ("levels", layout["levels"] <= _LEVELS_MAX),
        ("cell_rows", layout["levels"] > _LEVELS_MAX or cell == _places(layout)[1]),
        ("strip_rows", layout["strip_rows"] == _STRIP * triples + _gain_rows(layout)),
        ("zero_order_samples", layout["zero_order_samples"] >= 2),
        ("inner_rows", all(2 <= n <= taken - 2 * _RIM for n, taken in zip(inner, cell, strict=True))),
        ("u_first", max(reach) <= 2 + layout["texel"]),
        ("w_min", layout["w_min"] < layout["w_max"]),
    ):
        if not fits:
            return name
    return "" if picture.shape == (*_picture_size(layout), 3) else "layout"


def _triples(layout: dict[str, Any]) -> int:
    """The number of channels over 3: the number of strips, and of each term's cells."""
    return channel_count(layout["illuminant"]) // 3


def _gain_rows(layout: dict[str, Any]) -> int:
    """The rows of a plate's gains."""
    return _GAINS if layout["plate_ior"] > 1 else 0


def _is_basis(basis: object, count: int) -> bool:
    """Whether it is a list of `count` numbers in the range of coefficients of functions of at most 1."""
    return (
        isinstance(basis, list)
        and len(basis) == count
        and all(type(each) in (int, float) and abs(each) <= 2 for each in basis)
    )


def _fault_of_provenance(record: dict[str, Any]) -> str:
    """The name of an invalid value of the provenance that verdict.py reads; "" if there is none."""
    asked, pixel = record.get("asked_delta_e", 1.0), record.get("pixel_size_m", [1.0, 1.0])
    heights = record.get("heights_sha256", [])
    request = record.get("request")
    matter = request.get("matter", DIELECTRIC) if isinstance(request, dict) else DIELECTRIC
    layout = record["layout"]
    if _held(matter) != (layout["ratio_ior"], layout["plate_ior"]):
        return "matter"
    if type(asked) not in (int, float) or not 0 < asked < 100:
        return "asked_delta_e"
    if not (isinstance(pixel, list) and [type(side) for side in pixel] == [float, float] and min(pixel) > 0):
        return "pixel_size_m"
    if not (isinstance(heights, list) and all(isinstance(digest, str) for digest in heights)):
        return "heights_sha256"
    return ""


def _held(matter: object) -> tuple[float, float] | None:
    """The indices of a matter's ratio form and of its plate; None for what is no matter."""
    try:
        found = parse(matter) if isinstance(matter, str) else None
    except GratingError:
        return None
    return None if found is None else (found.ratio_ior, found.plate_ior)


def _table(image: np.ndarray, record: dict[str, Any]) -> Table:
    """The table in a picture (height, width, 3), row 0 at the bottom, that its header fits."""
    layout = record["layout"]
    rows, columns, across = layout["cell_rows"], layout["cell_columns"], layout["columns"]
    count, samples, triples = layout["terms"], layout["zero_order_samples"], _triples(layout)
    levels = []
    for place in _places(layout)[0]:
        # The cells of all terms for XYZ come first, then those for the next three channels.
        tiles = np.empty((count, place.rows, place.columns, 3 * triples), np.float32)
        for cell in range(count * triples):
            bottom = layout["strip_rows"] + cell // across * rows + place.bottom
            left = cell % across * columns + place.left
            triple, k = divmod(cell, count)
            own = image[bottom : bottom + place.rows, left : left + place.columns]
            tiles[k, ..., 3 * triple : 3 * triple + 3] = own
        levels.append(tiles * np.float32(layout["scale"] * layout["largest_albedo"]))
    return Table(
        terms=levels[0],
        zero_order=np.hstack([image[_STRIP * triple, :samples] for triple in range(triples)]).astype(float)
        * layout["largest_albedo"],
        ratio_ior=layout["ratio_ior"],
        first=(layout["u_first"], layout["v_first"]),
        texel=layout["texel"],
        w_range=(layout["w_min"], layout["w_max"]),
        sigma_b=layout["sigma_b"],
        illuminant=layout["illuminant"],
        basis=np.reshape(layout["basis"], (count, layout["polynomials"])).astype(float),
        record=record,
        wider=tuple(levels[1:]),
        ratio=layout["level_ratio"],
        offset=layout["level_offset"],
        coarser=layout["level_coarser"],
    )


def _places(layout: dict[str, Any]) -> tuple[list[Place], tuple[int, int]]:
    """The places of all levels' tiles, and rows and columns of a cell."""
    inner = layout["inner_rows"], layout["inner_columns"]
    return places_of(inner, layout["levels"], ratio=layout["level_ratio"], coarser=layout["level_coarser"])


def _picture_size(layout: dict[str, Any]) -> tuple[int, int]:
    """Height and width of a picture with this layout: the strip, and above it a cell for each term."""
    gains = (1 + _triples(layout)) * _gain_rows(layout)
    height = layout["strip_rows"] + layout["rows"] * layout["cell_rows"]
    return height, max(layout["columns"] * layout["cell_columns"], layout["zero_order_samples"] + 1, gains)
