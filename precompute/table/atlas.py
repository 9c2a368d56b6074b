# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs a bake into one OpenEXR image, and writes and reads the files of tables and sample sets.

The tiles B_k are side by side, the zero order's curve in a strip below. One image takes one texture slot. It holds
linear numbers without colour management, and all parameters are in its header. It holds half floats, or floats for a
deep relief or a small colour error, which need more than three digits.

The image is read by cubic B-splines: Blender's interpolation "Cubic", which reads at full resolution at any distance.
With the first texel's centre at index coordinate 0, a reading at x uses the texels floor(x) - 1 to floor(x) + 2. From
the bottom of the picture upward, the rows hold:

    STRIP_ROWS rows         the curve Z(w) in texels 0 to samples - 1, the same in each of these rows; the texel after
                            the last continues the line through the last two. With more channels than XYZ
                            (colour/channels.py), each three have STRIP_ROWS rows
    gain_texels rows        for a relief under a plate, its gains (plate_gains.py), each in gain_texels columns: that of
                            the scattered light, the same in every channel; then the mirror image's, for each three
                            channels
    above `strip_rows`      a cell for each term, with its tiles of every blur level (table.py); then the same for each
                            three further channels

Tiles hold B_k / scale in XYZ. The strip is not scaled: a shallow relief scatters so little, compared with its zero
order's white, that a common scale would lose the tiles' digits.

Files are written completely or not at all (base/files.py). A header must fit the picture and have values that a bake
can have."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import Field, asdict, dataclass, fields, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from ..base import files
from ..base.exr_reader import Picture, open_picture
from ..base.failure import GratingError
from ..base.machine import bundled
from ..base.strict import LARGEST_BYTES, parse_json
from ..colour.channels import channel_count
from ..colour.illuminants import is_illuminant
from ..optics.brdf import NO_RATIO, RATIO_IOR, RATIO_IOR_MAX
from ..optics.plate import NO_PLATE, PLATE_IOR_MAX
from ..optics.region import FARTHEST, Region
from ..reflectance.matter import DIELECTRIC, MIRROR, Matter
from ..reflectance.matter import parse as parse_matter
from .blur_levels import (
    COARSER_MAX,
    LEVELS_MAX,
    PICTURE_SIDE_MAX,
    SPACINGS,
    TERMS_MAX,
    TILE_PADDING,
    Cell,
    Spacing,
    grid,
)
from .plate_gains import GAIN_TEXELS, PlateGains
from .table import Table, past_end

# Rows of the picture that repeat the curve Z(w): a cubic reading at their centre uses only these rows.
STRIP_ROWS = 4
# Half floats end at 65504 and lose digits below 6e-5. The scale puts a table's largest value under this number.
LARGEST_STORED = 8192.0
# The range of kernels: from a coherence of 31 mm, three times the longest allowed, to a light that fills the sky.
_KERNELS = 8e-6, 1.0
# The range of all bakes' scales: the largest value of a table, over LARGEST_STORED. The value is at least 1e-30. At
# most it is (2 pi d / lambda)^2 / (2 pi sigma_b^2) for heights d apart: 7e17 for a relief of 1 mm.
_SCALES = 1e-35, 1e15
# The functions of w are at most 1 over their range, so the coefficients of their polynomials are at most 4 / pi.
_COEFFICIENT_MAX = 1.5
# The ratio form sends back at most 1.58 times the light on the steepest gratings that were tried (docs/theory.md).
_ALBEDO_MAX = 16.0
# The least width of a range of w.
_W_WIDTH_MIN = 1e-3


@dataclass(frozen=True)
class Layout:
    """How a reader finds u, v and w in the image. A material's nodes need nothing else.

    The picture holds rows x columns cells, one for each of the `terms` terms of XYZ and then of each three further
    channels, from left to right and then upward. A
    cell has cell_rows x cell_columns texels. The tile of blur level 0 is in its lower left corner: inner_rows x
    inner_columns texels that hold the table, and TILE_PADDING more on each side for interpolation. The centre of
    the tile's texel (0, 0) is at (v_first, u_first). table.py places the other levels, whose kernels' variances
    follow from level_ratio and level_offset, and whose texels are coarser by level_coarser. `texel` is the step of
    u and v per texel on level 0. Tiles are stored divided by `scale`. A term's function of w sums `polynomials`
    Chebyshev polynomials; `basis` holds the coefficients, term by term. Under a plate of the index plate_ior, which
    else is 1, u, v and w are those of the directions inside. `ratio_ior` and `largest_albedo` are the
    table's (table.py)."""

    terms: int
    polynomials: int
    basis: list  # type: ignore[type-arg]  # read_header compares the value's type with this type
    levels: int
    level_ratio: float
    level_offset: float
    level_coarser: float
    cell_rows: int
    cell_columns: int
    inner_rows: int
    inner_columns: int
    columns: int
    rows: int
    strip_rows: int
    texel: float
    u_first: float
    v_first: float
    w_min: float
    w_max: float
    sigma_b: float
    scale: float
    zero_order_samples: int
    ratio_ior: float
    largest_albedo: float
    plate_ior: float
    illuminant: str

    @property
    def holds_reflectance(self) -> bool:
        """Whether the table holds its matter's reflectance."""
        return self.ratio_ior != NO_RATIO

    @property
    def triples(self) -> int:
        """The number of channels over 3: the number of cells of each term."""
        return channel_count(self.illuminant) // 3

    @property
    def curve_rows(self) -> int:
        """Rows of the curves Z(w) of all channels."""
        return STRIP_ROWS * self.triples

    @property
    def width(self) -> int:
        """Columns of the picture."""
        gains = self.gain_block(self.triples)[1].stop
        return max(self.columns * self.cell_columns, self.zero_order_samples + 1, gains)

    @property
    def height(self) -> int:
        """Rows of the picture."""
        return self.rows * self.cell_rows + self.strip_rows

    @property
    def region(self) -> Region:
        """The region of (u, v) that the tiles hold, from the centre of the first inner texel to that of the last.

        A reading outside gives the value at the rim; the materials show black there."""
        ends = TILE_PADDING * self.texel, (TILE_PADDING - 1) * self.texel
        u, v = (
            (first + ends[0], first + ends[1] + count * self.texel)
            for first, count in ((self.u_first, self.inner_columns), (self.v_first, self.inner_rows))
        )
        return Region(u, v)

    @property
    def whole(self) -> bool:
        """Whether the tiles hold every pair of directions."""
        ends = (self.w_min, self.w_max) == (0, 2)
        rim = self.farthest - 1e-9
        return ends and all(low <= -rim and high >= rim for low, high in self.region)

    @property
    def farthest(self) -> float:
        """The greatest |(u, v)| of any pair of directions."""
        return FARTHEST / self.plate_ior

    @property
    def has_polynomials(self) -> bool:
        """Whether the terms' functions of w are the Chebyshev polynomials themselves."""
        return self.terms == self.polynomials and self.basis == np.eye(self.terms).ravel().tolist()

    @property
    def gain_texels(self) -> int:
        """Rows and columns of each of a plate's gains; 0 without a plate."""
        return _gain_texels(self.plate_ior)

    def gain_block(self, which: int) -> tuple[slice, slice]:
        """Rows and columns of a plate's gain, counted upward: 0 is that of the scattered light, the others that of the
        mirror image's next three channels."""
        first = which * self.gain_texels
        return slice(self.strip_rows - self.gain_texels, self.strip_rows), slice(first, first + self.gain_texels)

    @property
    def is_valid(self) -> bool:
        """Whether a bake can have this layout. Headers with other layouts are rejected.

        Each condition is safe to evaluate if the conditions before it hold."""
        tiles = self.levels, self.terms, self.cell_rows, self.cell_columns, self.columns, self.rows
        table = self.inner_rows, self.inner_columns
        return (
            min(tiles) >= 1
            and min(*table, self.zero_order_samples) >= 2
            and max(table) <= PICTURE_SIDE_MAX
            and self.levels <= LEVELS_MAX
            and self.spacing in SPACINGS
            and 1 <= self.level_coarser <= COARSER_MAX
            and is_illuminant(self.illuminant)
            and self.terms <= TERMS_MAX
            and self.terms * self.triples <= self.columns * self.rows
            and 1 <= self.polynomials <= TERMS_MAX
            and len(self.basis) == self.terms * self.polynomials
            and all(type(each) in (int, float) and abs(each) <= _COEFFICIENT_MAX for each in self.basis)
            and (self.cell_rows, self.cell_columns) == self.cell.size
            and self.curve_rows + self.gain_texels == self.strip_rows
            and (self.ratio_ior == NO_RATIO or RATIO_IOR <= self.ratio_ior <= RATIO_IOR_MAX)
            and 1 <= self.largest_albedo <= (_ALBEDO_MAX if self.holds_reflectance else 1)
            and _KERNELS[0] <= self.sigma_b <= _KERNELS[1]
            and _SCALES[0] <= self.scale <= _SCALES[1]
            and 0 <= self.w_min <= self.w_max - _W_WIDTH_MIN
            and self.w_max <= 2
            and 0 < self.texel <= 2 * FARTHEST
            and all(-FARTHEST - self.texel <= end <= FARTHEST + self.texel for side in self.region for end in side)
            and NO_PLATE <= self.plate_ior <= PLATE_IOR_MAX
            and (self.plate_ior == NO_PLATE or self.holds_reflectance)
        )

    @cached_property
    def cell(self) -> Cell:
        """The cell of a term, which places the tiles of the blur levels."""
        return Cell((self.inner_rows, self.inner_columns), self.levels, self.spacing, self.level_coarser)

    @property
    def spacing(self) -> Spacing:
        """How far apart the blur levels are."""
        return Spacing(self.level_ratio, self.level_offset)

    def cell_origin(self, term: int, triple: int = 0) -> tuple[int, int]:
        """Lower left texel (x, y) of a term's cell of three channels, y counted upward."""
        row, column = divmod(triple * self.terms + term, self.columns)
        return column * self.cell_columns, self.strip_rows + row * self.cell_rows

    def tile_origin(self, term: int, level: int = 0, triple: int = 0) -> tuple[int, int]:
        """Lower left texel (x, y) of a tile, y counted upward."""
        (x, y), (right, up) = self.cell_origin(term, triple), self.cell.corner(level)
        return x + right, y + up

    def tile_block(self, term: int, level: int, triple: int = 0) -> tuple[slice, slice]:
        """Rows and columns of the picture that a tile fills, including its padding."""
        x, y = self.tile_origin(term, level, triple)
        rows, columns = self.cell.inner_of(level)
        return slice(y, y + rows + 2 * TILE_PADDING), slice(x, x + columns + 2 * TILE_PADDING)


def _gain_texels(plate_ior: float) -> int:
    return 0 if plate_ior == NO_PLATE else GAIN_TEXELS


def layout_of(bake: Table) -> Layout:
    """The layout of a bake's atlas. Raises GratingError if the picture is too large for a graphics card."""
    terms, cell = len(bake.terms), bake.cell
    triples = channel_count(bake.illuminant) // 3
    gain_texels = _gain_texels(bake.plate_ior)
    width = max(len(bake.zero_order) + 1, (1 + triples) * gain_texels)
    rows, columns = grid(terms * triples, cell.size, width_min=width)
    peak = max(*(float(np.abs(terms).max()) for terms in bake.levels), 1e-30)
    return Layout(
        terms=terms,
        polynomials=bake.basis.shape[1],
        basis=bake.basis.ravel().tolist(),
        levels=cell.levels,
        level_ratio=cell.spacing.ratio,
        level_offset=cell.spacing.offset,
        level_coarser=cell.coarser,
        cell_rows=cell.size[0],
        cell_columns=cell.size[1],
        inner_rows=cell.inner[0],
        inner_columns=cell.inner[1],
        columns=columns,
        rows=rows,
        strip_rows=STRIP_ROWS * triples + gain_texels,
        texel=bake.texel,
        u_first=float(bake.first[1]),
        v_first=float(bake.first[0]),
        w_min=float(bake.w_range[0]),
        w_max=float(bake.w_range[1]),
        sigma_b=bake.sigma_b,
        scale=2.0 ** math.ceil(math.log2(peak / LARGEST_STORED)),
        zero_order_samples=len(bake.zero_order),
        ratio_ior=bake.ratio_ior,
        largest_albedo=bake.largest_albedo,
        plate_ior=bake.plate_ior,
        illuminant=bake.illuminant,
    )


def pack(bake: Table, layout: Layout | None = None) -> tuple[np.ndarray, Layout]:
    """The image (height, width, 3) in the bake's precision, row 0 at the bottom, and its layout: its own, or a given
    one that differs in the scale.

    Raises GratingError if the picture is too large for a graphics card."""
    layout = layout or layout_of(bake)
    image = np.zeros((layout.height, layout.width, 3), bake.precision)
    zero_order = bake.zero_order.astype(bake.precision)
    for triple in range(layout.triples):
        curve = zero_order[:, 3 * triple : 3 * triple + 3]
        rows = slice(STRIP_ROWS * triple, STRIP_ROWS * (triple + 1))
        image[rows] = past_end(curve)
        image[rows, : len(curve)] = curve
    if bake.gains is not None:
        image[layout.gain_block(0)] = bake.gains.scattered[..., None]
        for triple in range(layout.triples):
            image[layout.gain_block(1 + triple)] = bake.gains.mirror[..., 3 * triple : 3 * triple + 3]
    for level, terms in enumerate(bake.levels):
        for k, tile in enumerate(terms):
            for triple in range(layout.triples):
                own = tile[..., 3 * triple : 3 * triple + 3]
                image[layout.tile_block(k, level, triple)] = own / layout.scale
    return image, layout


def pack_layers(bakes: Sequence[Table]) -> tuple[np.ndarray, Layout]:
    """The images of tables of one grid, of the same functions of w and levels, one above the other, and the layout of
    each. Raises GratingError if the picture is too large for a graphics card."""
    own = [layout_of(bake) for bake in bakes]
    layout = replace(own[0], scale=max(each.scale for each in own))
    if layout.height * len(bakes) > PICTURE_SIDE_MAX:
        raise GratingError("", f"{len(bakes)} layers of {layout.height} rows are larger than a graphics card takes", "")
    return np.concatenate([pack(bake, layout)[0] for bake in bakes]), layout


def unpack(image: np.ndarray, layout: Layout) -> Table:
    """The bake in an image (height, width, 3), row 0 at the bottom."""
    terms, *wider = (
        np.stack([_channels(image, layout, k, level) for k in range(layout.terms)]).astype(np.float32)
        * np.float32(layout.scale)
        for level in range(layout.levels)
    )
    curves = [image[STRIP_ROWS * triple, : layout.zero_order_samples] for triple in range(layout.triples)]
    zero_order = np.concatenate(curves, axis=-1).astype(np.float32)
    gains = None
    if layout.gain_texels:
        scattered, *mirror = (image[layout.gain_block(k)].astype(np.float32) for k in range(1 + layout.triples))
        gains = PlateGains(scattered[..., 0], np.concatenate(mirror, axis=-1))
    first, w_range = (layout.v_first, layout.u_first), (layout.w_min, layout.w_max)
    return Table(
        terms, zero_order, layout.sigma_b, layout.texel, layout.illuminant, layout.ratio_ior, first,
        w_range, image.dtype.type,
        tuple(wider), layout.spacing, layout.level_coarser,
        np.reshape(layout.basis, (layout.terms, layout.polynomials)).astype(float), layout.plate_ior,
        layout.largest_albedo, gains,
    )  # fmt: skip


def _channels(image: np.ndarray, layout: Layout, term: int, level: int) -> np.ndarray:
    """All channels (rows, columns, channels) of a term's tile."""
    return np.concatenate([image[layout.tile_block(term, level, k)] for k in range(layout.triples)], axis=-1)


# The version of the files. A reader refuses all others.
FORMAT = 14
# The header's attribute that holds the record.
HEADER_KEY = "natural_gratings"
# The types of a record's optional values beside `format` and `layout` (bake/make.py).
_PROVENANCE = {
    "source": str, "channel": str, "model": str, "precision": str, "height_range_m": float, "coherence_um": float,
    "coherence_areas": float, "asked_delta_e": float, "heights_sha256": list, "pixel_size_m": list, "shape": list,
    "request": dict, "delta_e": dict, "extrema": list,
}  # fmt: skip


class AnyLayout(Protocol):
    """The protocol of all pictures' layouts: dataclasses whose fields go into the header."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init__(self, **values: Any) -> None: ...

    @property
    def height(self) -> int: ...

    @property
    def width(self) -> int: ...

    @property
    def is_valid(self) -> bool: ...


_Layout = TypeVar("_Layout", bound=AnyLayout)


def write_together(pictures: Mapping[Path, tuple[np.ndarray, AnyLayout]], provenance: Mapping[str, Any]) -> None:
    """Write images (height, width, 3 or 4), row 0 at the bottom, each with its layout, by path; all or none.

    The header's attribute `natural_gratings` is JSON: format, layout, and the keys of `provenance`. Raises
    GratingError, with the path, if a file cannot be written or its header is too long to be read."""
    writers = {}
    for path, (image, layout) in pictures.items():
        record = json.dumps({"format": FORMAT, "layout": asdict(layout), **provenance}, sort_keys=True)
        if len(record) > LARGEST_BYTES:
            raise GratingError(path, "its header would be longer than is read", "bake fewer scans together")
        writers[path] = partial(write_exr, image=image, attributes={HEADER_KEY: record})
    files.write_together(writers)


def write_exr(path: Path, image: np.ndarray, attributes: Mapping[str, str]) -> None:
    """Write an image (height, width, 3 or 4), row 0 at the bottom, as OpenEXR with attributes in its header.

    Raises OSError if it cannot be written, GratingError if OpenEXR cannot be loaded."""
    OpenEXR = bundled("OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    channels = {"RGBA"[: image.shape[2]]: np.ascontiguousarray(image[::-1])}
    # Given a path, OpenEXR fails outside UTF-8 and hides the system's error messages.
    with OpenEXR.File(header, channels) as picture, path.open("wb") as file:
        picture.write(file)


def check_can_write() -> None:
    """Raises GratingError if no picture can be written, before a bake starts."""
    bundled("OpenEXR")


def read_header(path: Path) -> tuple[Layout, dict[str, Any]]:
    """Layout and header record of an atlas. Raises GratingError if the file is not an atlas."""
    return _parse(open_picture(path))


def read_sound_header(path: Path) -> tuple[Layout, dict[str, Any]]:
    """read_header for a file that Blender is going to read: checks every pixel too.

    Raises GratingError if the file is not an atlas, its picture is damaged or a pixel is not a number."""
    picture = open_picture(path)
    found = _parse(picture)
    picture.check_pixels()
    return found


def read(path: Path) -> tuple[Table, dict[str, Any]]:
    """Read the bake in an atlas file, and its header record. Raises GratingError as read_sound_header does.

    The library's page calls it read_bake:

    >>> table, record = read_bake(Path("bakes/blazed.exr"))
    >>> table.illuminant, record["request"]["delta_e"]
    ('D65', 2)"""
    picture = open_picture(path)
    layout, record = _parse(picture)
    return unpack(picture.pixels(), layout), record


def parse(
    picture: Picture, layout_type: type[_Layout], *, channels: str = "RGB",
    expected: tuple[str, str] = ("bake", "give the .exr that `bake` wrote"),
) -> tuple[_Layout, dict[str, Any]]:  # fmt: skip
    """Layout and record of a picture's header.

    Raises GratingError, naming what was `expected`, if the header's layout is missing or does not fit the picture."""
    path = picture.path
    record = _record_in(picture, expected)
    if record["format"] != FORMAT:
        raise GratingError(path, f"made by another version (format {record['format']!r:.20})", "bake it again")
    kinds, values = {field.name: field.type for field in fields(layout_type)}, record.get("layout")
    if not isinstance(values, dict) or set(values) != set(kinds):
        raise GratingError(path, f"not a Natural Gratings {expected[0]}", expected[1])
    told = {name: kind for name, kind in _PROVENANCE.items() if name in record}
    for name, kind in (kinds | told).items():
        value = values[name] if name in kinds else record[name]
        # JSON may write 2.0 as 2; bool is no number here.
        if type(value) is not kind and (kind, type(value)) != (float, int):
            raise GratingError(path, f"its header's {name} is {value!r:.40}", "bake it again")
    layout = layout_type(**values)
    if not layout.is_valid:
        raise GratingError(path, "its header has values that no picture of this kind has", "bake it again")
    if picture.shape != (layout.height, layout.width, len(channels)):
        raise GratingError(path, "the picture is not the size that its header says", "bake it again")
    return layout, record


def read_record(path: Path) -> dict[str, Any]:
    """The header record of a table or a sample set, whose values are not checked. Raises GratingError if there is
    none."""
    return _record_in(open_picture(path), ("bake", "give the .exr that `bake` wrote"))


def _record_in(picture: Picture, expected: tuple[str, str]) -> dict[str, Any]:
    if HEADER_KEY in picture.texts:
        record = parse_json(picture.texts[HEADER_KEY], picture.path, "bake it again", part="its header: ")
        if isinstance(record, dict) and "format" in record:
            return record
    raise GratingError(picture.path, f"not a Natural Gratings {expected[0]}", expected[1])


def _parse(picture: Picture) -> tuple[Layout, dict[str, Any]]:
    """Layout and record of an atlas. The record must match the pixels' precision, for a sample set as well."""
    layout, record = parse(picture, Layout)
    precision = np.dtype(picture.precision).name
    if record.get("precision", precision) != precision:
        told = f"holds {precision}, not its header's {record['precision']!r:.20}"
        raise GratingError(picture.path, told, "bake it again")
    matter = matter_in(layout, record, picture.path)
    if (matter.ratio_ior, matter.plate_ior) != (layout.ratio_ior, layout.plate_ior):
        raise GratingError(picture.path, "its header's matter does not fit its picture", "bake it again")
    return layout, record


def matter_in(layout: Layout, record: dict[str, Any], path: Path) -> Matter:
    """The matter in the header record of an atlas. If the record names none, it is a mirror for a table that holds a
    reflectance, else a dielectric. Raises GratingError if the record's text is no matter."""
    unnamed = MIRROR if layout.holds_reflectance else DIELECTRIC
    text = record.get("request", {}).get("matter", unnamed)
    if not isinstance(text, str):
        raise GratingError(path, f"its header's matter is {text!r:.40}", "bake it again")
    try:
        return parse_matter(text)
    except GratingError as error:
        raise GratingError(path, f"its header's matter is {text!r:.40}", "bake it again") from error
