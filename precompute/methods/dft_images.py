# SPDX-License-Identifier: GPL-3.0-or-later
"""The transforms that FLSS, NMM and PQ read, as one OpenEXR image for a shader (thesis Algorithm 1).

Tile n, at column n % columns and row n // columns counted upward from the picture's bottom, holds term n: R = real,
G = imaginary, float32, linear; in it rows run along +v, columns along +u, and (tile_rows // 2, tile_columns // 2) is
the zero frequency. A Chebyshev term is stored times its (-i)^n, so that every expansion's coefficients are real:

    Taylor      z^n / n!, z = -2 pi s scale_m          of (i h / scale_m)^n
    Chebyshev   J_0(z), 2 J_n(z), z = 2 pi s scale_m   of (-i)^n T_n(h / scale_m)

B is 1 in the bottom row and 0 above: renderers do not agree which way a texture's t runs, and a shader asks it so.
Three channels, since some take a picture of two for grey with alpha, and divide one of four by its alpha.
"""

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..spectra.patch_window import PatchWindow
from ..surface.height_map import HeightMap
from ..surface.relief import Relief, prepare
from ..table import atlas_file
from ..table.atlas_file import write_together
from .method import Method, Settings
from .nmm import Nmm
from .pq import Pq
from .registry import METHODS
from .term_images import WindowedImages, left_out

# Those that a shader has; "chebyshev" is FLSS over Chebyshev terms, for reliefs too deep for Taylor's.
DFT_METHODS = ("flss", "chebyshev", "nmm", "nmm-jacobian", "pq")


TEXELS_MAX = 31


# Of the window's weights: 7e-4 at 5 texels and a relief as long as its coherence.
_LEFT_OUT = 1e-3


@dataclass(frozen=True)
class Layout:
    """What a shader needs beside the image; what a method has no use for is 0 (sigma_f, period_m) or 1 (copies).

    length_*_m  of what was transformed, along B (v) and T (u): a bin is 1 / length
    scale_m     of the heights in the expansion
    sigma_f     of the Gaussian window's transform, cycles per metre
    power       turns |sum|^2 / lambda^2 into the density over (u, v), square metres
    copies_*    of the cell, along B (v) and T (u)
    texels      read around each frequency, a side
    """

    method: str
    expansion: str
    terms: int
    tile_rows: int
    tile_columns: int
    columns: int
    length_v_m: float
    length_u_m: float
    scale_m: float
    sigma_f: float
    power: float
    copies_v: int
    copies_u: int
    period_m: float
    texels: int
    step_m: float
    illuminant: str

    @property
    def rows(self) -> int:
        return math.ceil(self.terms / self.columns)

    @property
    def width(self) -> int:
        return self.columns * self.tile_columns

    @property
    def height(self) -> int:
        return self.rows * self.tile_rows

    @property
    def is_valid(self) -> bool:
        """Whether a shader can make something of it."""
        counts = self.terms, self.tile_rows, self.tile_columns, self.columns, self.texels, self.copies_v, self.copies_u
        return (
            self.method in DFT_METHODS
            and self.expansion in ("taylor", "chebyshev")
            and all(isinstance(n, int) and n > 0 for n in counts)
            and all(x > 0 for x in (self.length_v_m, self.length_u_m, self.scale_m, self.power, self.step_m))
        )


def pack(method: Method) -> tuple[np.ndarray, Layout]:
    """Image (height, width, 3) float32, row 0 at the bottom, of one of DFT_METHODS as METHODS builds it."""
    images, expansion, facts = _parts(method)
    rows, columns, terms = images.terms.shape
    chebyshev = not hasattr(expansion, "scale_m")
    layout = Layout(
        method=method.name,
        expansion="chebyshev" if chebyshev else "taylor",
        terms=terms,
        tile_rows=rows,
        tile_columns=columns,
        columns=math.ceil(math.sqrt(terms)),
        length_v_m=images.size_m[0],
        length_u_m=images.size_m[1],
        scale_m=expansion.half_range_m if chebyshev else expansion.scale_m,
        texels=method.settings.texels,
        step_m=method.settings.step_m,
        illuminant=method.settings.illuminant,
        **facts,
    )
    image = np.zeros((layout.height, layout.width, 3), np.float32)
    image[0, :, 2] = 1
    for n in range(terms):
        term = images.terms[..., n] * ((-1j) ** n if chebyshev else 1)
        y, x = divmod(n, layout.columns)
        tile = image[y * rows : (y + 1) * rows, x * columns : (x + 1) * columns]
        tile[..., 0], tile[..., 1] = term.real, term.imag
    return image, layout


def _parts(method: Method):
    """Images, expansion and the rest of the layout of a method."""
    if isinstance(method, Pq):
        area = float(np.prod(method.images.size_m) * np.prod(method.copies))
        along_v, along_u = method.copies
        facts = {"sigma_f": 0.0, "power": area, "copies_v": along_v, "copies_u": along_u, "period_m": 0.0}
        return method.images, method.expansion, facts
    period_m = method.period_m if isinstance(method, Nmm) else 0.0
    full: WindowedImages = method.full if isinstance(method, Nmm) else method
    facts = {"sigma_f": full.sigma_f, "power": full.scale, "copies_v": 1, "copies_u": 1, "period_m": period_m}
    return full.images, full.expansion, facts


def settings_for(**asked) -> Settings:
    """Settings of a method for a shader: heights from the middle of the relief, since a shader has the coefficients of
    Taylor's series in single precision, and its terms cancel."""
    return Settings(dtype=np.float32, centred=True, **asked)


def texels_for(relief: Relief, settings: Settings) -> int:
    """Texels a side, odd, up to TEXELS_MAX, that leave out a thousandth of the window: 5 where the relief is as long
    as the coherence, and more where it is longer."""
    sigma_bins = max(relief.size_m) * PatchWindow(relief, settings.patch_sigma_m).sigma_f
    odd = range(1, TEXELS_MAX + 1, 2)
    return next((n for n in odd if left_out(n, sigma_bins) <= _LEFT_OUT), TEXELS_MAX)


def images_to_folder(
    height_map: HeightMap, name: str, settings: Settings, folder: Path, progress: Callable[[str, float], None]
) -> dict:
    """Write the images of a method of a height map into a folder; the facts, as `--json` gives them.

    Settings of 0 texels are given those of texels_for. Raises GratingError, naming the source, for a relief that the
    method cannot take."""
    progress("transforms", 0.0)
    relief = prepare(height_map)
    if settings.texels == 0:
        settings = replace(settings, texels=texels_for(relief, settings))
    try:
        method = METHODS[name](relief, settings)
    except GratingError as error:
        raise GratingError(f"{height_map.source}: {error}") from error
    image, layout = pack(method)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{height_map.stem}_{name}.exr"
    heights = hashlib.sha256(np.ascontiguousarray(height_map.height_m).tobytes()).hexdigest()
    provenance = {"source": height_map.source_name, "heights_sha256": [heights], "extrema": _extrema(image, layout)}
    write_together({path: (image, layout)}, provenance)
    progress("transforms", 1.0)
    return {
        "method": name,
        "expansion": layout.expansion,
        "terms": layout.terms,
        "tile": [layout.tile_rows, layout.tile_columns],
        "image_bytes": image.nbytes,
        "files": [str(path)],
    }


def _extrema(image: np.ndarray, layout: Layout) -> list[list[float]]:
    """Smallest and largest real, smallest and largest imaginary part of each term, with which the thesis scaled its
    images to 0..1."""
    shape = layout.rows, layout.tile_rows, layout.columns, layout.tile_columns, 3
    tiles = np.moveaxis(image.reshape(shape), 2, 1).reshape(-1, layout.tile_rows, layout.tile_columns, 3)
    return [
        [float(f) for c in (0, 1) for f in (tile[..., c].min(), tile[..., c].max())] for tile in tiles[: layout.terms]
    ]


def read_layout(path: Path) -> Layout:
    """The layout in a file's header. Raises GratingError if it is not a file of images."""
    header, _ = atlas_file.open_file(path, header_only=True)
    return atlas_file.parse(path, header, Layout, "file of DFT images; give the .exr that `dft` wrote")[0]
