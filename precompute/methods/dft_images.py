# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the transforms that FLSS, NMM and PQ read into one OpenEXR image for a shader (thesis Algorithm 1).

Tile n holds term n: R is its real part and G its imaginary part, float32, linear. It is at column n % columns and row n
// columns, counted upward from the bottom of the picture. Inside a tile the x axis is +u and the y axis +v, and the
zero frequency is at (tile_rows // 2, tile_columns // 2). A Chebyshev term is stored times its (-i)^n, so that all
coefficients are real:

    Taylor      z^n / n!, z = -2 pi s scale_m          of (i h / scale_m)^n
    Chebyshev   J_0(z), 2 J_n(z), z = 2 pi s scale_m   of (-i)^n T_n(h / scale_m)

B is 1 in the bottom row and 0 above, because renderers disagree on the direction of a texture's t, and a shader reads
it from B. There are three channels because some renderers read two as grey with alpha, and divide four by alpha.
"""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base import exr_reader
from ..base.failure import GratingError, Setting
from ..base.progress import Progress, silent
from ..spectra.spectrum import PatchWindow
from ..surface.height_map import HeightMap
from ..surface.relief import Relief, prepare
from ..surface.steps.pipeline import DEFAULT
from ..surface.steps.step import Step
from ..table.atlas import check_can_write, write_together
from .dft_layout import TEXELS_MAX, Layout
from .method import Method, Settings
from .method_registry import METHODS
from .windowed_images import left_out

# The largest share of the window's weights that texels_for leaves out. With 5 texels, and a relief as long as the
# coherence length, the share is 7e-4.
_LEFT_OUT = 1e-3


@dataclass(frozen=True)
class DftImages:
    """The written images of a method, and their size."""

    layout: Layout
    image_bytes: int
    files: tuple[Path, ...]

    def as_dict(self) -> dict[str, Any]:
        """Convert the result to JSON."""
        return {
            "method": self.layout.method,
            "expansion": self.layout.expansion,
            "terms": self.layout.terms,
            "tile": [self.layout.tile_rows, self.layout.tile_columns],
            "image_bytes": self.image_bytes,
            "files": [str(path) for path in self.files],
        }


def pack(method: Method) -> tuple[np.ndarray, Layout]:
    """Image (height, width, 3) float32, row 0 at the bottom, and its layout. Raises GratingError for a method without a
    shader, or for too many texels."""
    needed = method.shader_images()
    images, expansion = needed.images, needed.expansion
    rows, columns, terms = images.terms.shape
    chebyshev = expansion.series == "chebyshev"
    layout = Layout(
        method=method.name,
        expansion=expansion.series,
        terms=terms,
        tile_rows=rows,
        tile_columns=columns,
        columns=math.ceil(math.sqrt(terms)),
        length_v_m=images.size_m[0],
        length_u_m=images.size_m[1],
        scale_m=expansion.scale_m,
        sigma_f=needed.sigma_f,
        power=needed.power,
        copies_v=needed.copies[0],
        copies_u=needed.copies[1],
        period_m=needed.period_m,
        texels=method.settings.texels,
        step_m=method.settings.step_m,
        illuminant=method.settings.illuminant,
    )
    if layout.height * layout.width > exr_reader.TEXELS_MAX:
        raise GratingError(
            "",
            f"{terms} terms of {columns} x {rows} texels are more than {exr_reader.TEXELS_MAX >> 20} Mi",
            ("lower ", Setting.TERMS, ", or crop the scan"),
        )
    image = np.zeros((layout.height, layout.width, 3), np.float32)
    image[0, :, 2] = 1
    for n in range(terms):
        term = images.terms[..., n] * ((-1j) ** n if chebyshev else 1)
        y, x = divmod(n, layout.columns)
        tile = image[y * rows : (y + 1) * rows, x * columns : (x + 1) * columns]
        tile[..., 0], tile[..., 1] = term.real, term.imag
    return image, layout


def settings_for(**asked: Any) -> Settings:
    """Settings of a method for a shader, which holds the coefficients in single precision.

    Heights are counted from the middle of the relief, where the terms of the Taylor series cancel least."""
    return Settings(dtype=np.float32, centred=True, **asked)


def texels_for(relief: Relief, settings: Settings) -> int:
    """The least odd number of texels to read along each axis, up to TEXELS_MAX, that leaves out at most a thousandth of
    the window. It is 5 for a relief as long as the coherence length, and more for a longer relief."""
    sigma_bins = max(relief.size_m) * PatchWindow(relief, settings.patch_sigma_m).sigma_f
    odd = range(1, TEXELS_MAX + 1, 2)
    return next((n for n in odd if left_out(n, sigma_bins) <= _LEFT_OUT), TEXELS_MAX)


def images_to_folder(
    height_map: HeightMap,
    name: str,
    settings: Settings,
    *,
    folder: Path,
    levelling: Sequence[Step] = DEFAULT,
    progress: Progress = silent,
) -> DftImages:
    """Write the images of a method of a levelled height map into a folder, which is created if missing.

    If the settings have 0 texels, texels_for chooses their number. Raises GratingError, with the source, for a relief
    that the method cannot handle, and as `check_can_write` does."""
    check_can_write()
    progress("transforms", 0.0)
    relief = prepare(height_map, levelling)
    if settings.texels == 0:
        settings = replace(settings, texels=texels_for(relief, settings))
    try:
        method = METHODS[name](relief, settings)
    except GratingError as error:
        raise error.within(height_map.source) from error
    image, layout = pack(method)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{height_map.stem}_{name}.exr"
    heights = hashlib.sha256(np.ascontiguousarray(height_map.height_m).tobytes()).hexdigest()
    provenance = {"source": height_map.source_name, "heights_sha256": [heights], "extrema": _extrema(image, layout)}
    write_together({path: (image, layout)}, provenance)
    progress("transforms", 1.0)
    return DftImages(layout, image.nbytes, (path,))


def _extrema(image: np.ndarray, layout: Layout) -> list[list[float]]:
    """For each term, the least and greatest real part, then the least and greatest imaginary part.

    The thesis scaled its images to the range from 0 to 1 by these numbers."""
    shape = layout.rows, layout.tile_rows, layout.columns, layout.tile_columns, 3
    tiles = np.moveaxis(image.reshape(shape), 2, 1).reshape(-1, layout.tile_rows, layout.tile_columns, 3)
    return [
        [float(f) for c in (0, 1) for f in (tile[..., c].min(), tile[..., c].max())] for tile in tiles[: layout.terms]
    ]
