# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake as one OpenEXR image: the tiles B_k side by side, the zero order's curve in a strip below.

One image is one texture slot. Half floats, or floats where a deep relief or a small budget asks for more than their
three digits; linear, no colour management; all parameters stand in the header. Counting rows upward from the picture's
bottom: STRIP_ROWS rows hold Z(w) in texels 0 .. samples - 1, all alike so that filtering across them changes nothing;
then the excess albedo E (albedo.py), the horizon's row first, the same in every channel. Above these `strip_rows` tile
k stands at column k % columns, row k // columns. Tiles reach a little past |u| = 2, so that a filter at the rim of one
never touches the next. Tiles hold B_k / scale in XYZ; the strip is unscaled, since what a shallow relief scatters is
nothing to the white of its zero order.
"""

import json
import math
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import OpenEXR

from .bake import STRIP_ROWS, Bake, tile_block
from .budget import LARGEST_STORED
from .failure import GratingError

FORMAT = 4
HEADER_KEY = "natural_gratings"


@dataclass(frozen=True)
class Layout:
    """How a reader finds u, v, w in the image; what a material's nodes need, and nothing else."""

    terms: int
    tile_rows: int
    tile_columns: int
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
    limit_rows: int
    limit_columns: int
    illuminant: str

    @property
    def width(self) -> int:
        return self.columns * self.tile_columns

    @property
    def height(self) -> int:
        return self.rows * self.tile_rows + self.strip_rows

    @property
    def whole(self) -> bool:
        """Whether the tiles hold every direction."""
        last = self.u_first + (self.tile_columns - 1) * self.texel, self.v_first + (self.tile_rows - 1) * self.texel
        return (self.w_min, self.w_max) == (0, 2) and max(self.u_first, self.v_first) <= -2 and min(last) >= 2

    @property
    def limit_block(self) -> tuple[slice, slice]:
        """Rows and columns of the excess albedo, y upward."""
        return slice(STRIP_ROWS, STRIP_ROWS + self.limit_rows), slice(self.limit_columns)

    @property
    def sound(self) -> bool:
        """Whether the numbers can be those of an image: what a header says is believed only then."""
        tiles = self.terms, self.tile_rows, self.tile_columns, self.columns, self.rows
        strip = self.strip_rows, self.zero_order_samples, self.limit_rows, self.limit_columns
        return (
            all(isinstance(n, int) and n > 0 for n in tiles + strip)
            and all(math.isfinite(x) and x > 0 for x in (self.texel, self.sigma_b, self.scale))
            and all(math.isfinite(x) and abs(x) <= 4 for x in (self.u_first, self.v_first))
            and 0 <= self.w_min < self.w_max <= 2
            and self.terms <= self.columns * self.rows
            and self.zero_order_samples <= self.width
            and self.limit_columns <= self.width
            and STRIP_ROWS + self.limit_rows == self.strip_rows
        )

    def tile_origin(self, term: int) -> tuple[int, int]:
        """Lower left texel (x, y) of a tile, y upward."""
        row, column = divmod(term, self.columns)
        return column * self.tile_columns, self.strip_rows + row * self.tile_rows


def layout_of(bake: Bake) -> Layout:
    """The layout of a bake's atlas."""
    terms = len(bake.terms)
    tile_rows, tile_columns = bake.tile
    rows, columns = tile_block(terms, bake.tile, max(len(bake.zero_order), bake.limit.shape[1]))
    peak = max(float(np.abs(bake.terms).max()), 1e-30)
    return Layout(
        terms=terms,
        tile_rows=tile_rows,
        tile_columns=tile_columns,
        columns=columns,
        rows=rows,
        strip_rows=STRIP_ROWS + len(bake.limit),
        texel=bake.texel,
        u_first=float(bake.first[1]),
        v_first=float(bake.first[0]),
        w_min=float(bake.w_range[0]),
        w_max=float(bake.w_range[1]),
        sigma_b=bake.sigma_b,
        scale=2.0 ** math.ceil(math.log2(peak / LARGEST_STORED)),
        zero_order_samples=len(bake.zero_order),
        limit_rows=bake.limit.shape[0],
        limit_columns=bake.limit.shape[1],
        illuminant=bake.illuminant,
    )


def pack(bake: Bake) -> tuple[np.ndarray, Layout]:
    """Image (height, width, 3) of the bake's precision, row 0 at the bottom, and its layout."""
    layout = layout_of(bake)
    image = np.zeros((layout.height, layout.width, 3), bake.precision)
    image[:STRIP_ROWS] = bake.zero_order[-1]
    image[:STRIP_ROWS, : len(bake.zero_order)] = bake.zero_order
    image[layout.limit_block] = half_above(bake.limit)[..., None]
    for k, tile in enumerate(bake.terms):
        x, y = layout.tile_origin(k)
        image[y : y + layout.tile_rows, x : x + layout.tile_columns] = tile / layout.scale
    return image, layout


def unpack(image: np.ndarray, layout: Layout) -> Bake:
    """The bake that an image (height, width, 3), row 0 at the bottom, holds."""
    values = image.astype(np.float32)
    rows, columns = layout.tile_rows, layout.tile_columns
    origins = [layout.tile_origin(k) for k in range(layout.terms)]
    terms = np.stack([values[y : y + rows, x : x + columns] for x, y in origins]) * np.float32(layout.scale)
    zero_order = values[0, : layout.zero_order_samples]
    limit = image[layout.limit_block][..., 0].astype(np.float32)
    first, w_range = (layout.v_first, layout.u_first), (layout.w_min, layout.w_max)
    precision = image.dtype.type
    return Bake(
        terms, zero_order, layout.sigma_b, layout.texel, layout.illuminant, limit, first, w_range, precision
    )  # fmt: skip


def half_above(values: np.ndarray) -> np.ndarray:
    """The least half floats that are not under the values: a limit must not be rounded down."""
    half = values.astype(np.float16)
    return np.where(half < values, np.nextafter(half, np.float16(np.inf)), half)


def write(path: Path, image: np.ndarray, layout: Layout, provenance: dict) -> None:
    """Write an atlas under a temporary name and rename it: a broken run leaves no half file behind.

    The header's `natural_gratings` attribute is JSON: format, layout, provenance."""
    record = {"format": FORMAT, "layout": asdict(layout), **provenance}
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        HEADER_KEY: json.dumps(record, sort_keys=True),
    }
    # Blender and OpenEXR tell a file by its ending, so the temporary name keeps it.
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.partial.exr")
    try:
        with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image[::-1])}) as file:
            file.write(str(temporary))
        os.replace(temporary, path)
    except RuntimeError as error:  # OpenEXR's, for whatever the system says
        raise GratingError(f"{path}: cannot be written ({error}); check the folder and its space") from error
    finally:
        temporary.unlink(missing_ok=True)


def read_header(path: Path) -> tuple[Layout, dict]:
    """Layout and the whole header record of an atlas. Raises GratingError if it is not one."""
    return _parse(path, _open(path, header_only=True)[0])


def read(path: Path) -> tuple[Bake, dict]:
    """The bake in an atlas file and its header record. Raises GratingError if it is not one."""
    header, channels = _open(path, header_only=False)
    layout, record = _parse(path, header)
    image = channels["RGB"].pixels[::-1] if "RGB" in channels else np.empty(0)
    if image.shape != (layout.height, layout.width, 3):
        raise GratingError(f"{path}: the picture is not the size that its header says; bake it again")
    return unpack(image, layout), record


def _open(path: Path, header_only: bool) -> tuple[dict, dict]:
    """Header and channels (none if header_only)."""
    if not Path(path).is_file():
        raise GratingError(f"{path}: there is no such file; give the .exr that `bake` wrote")
    try:
        file = OpenEXR.File(str(path), header_only=header_only)
        return file.header(), {} if header_only else file.channels()
    except Exception as error:  # OpenEXR's own type differs by version
        raise GratingError(f"{path}: not a readable OpenEXR file; bake it again") from error


def _parse(path: Path, header: dict) -> tuple[Layout, dict]:
    try:
        record = json.loads(header[HEADER_KEY])
        if record["format"] != FORMAT:
            raise GratingError(f"{path}: made by another version (format {record['format']}); bake it again")
        layout = Layout(**record["layout"])
        if not layout.sound:
            raise ValueError(record["layout"])
        return layout, record
    except (KeyError, TypeError, ValueError) as error:
        raise GratingError(f"{path}: not a Natural Gratings bake; give the .exr that `bake` wrote") from error
