# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a bake's file independently of the code that packs and reads tables elsewhere."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.exr import Picture, open_picture
from ..base.failure import GratingError
from ..base.strict_json import parse_json
from ..colour.channels import channel_count
from ..colour.illuminants import is_illuminant
from ..optics.region import Region
from ..reflectance.matter import DIELECTRIC, MIRRORING, Matter
from ..reflectance.matter_text import parse
from .level_places import Place, places_of

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
        raise GratingError(path, f"its header's {fault} cannot be, or does not fit its picture", "bake it again")
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
