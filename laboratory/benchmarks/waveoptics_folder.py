# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder in which WaveOpticsBrdf and our patch model get the same surface, and in which its answers lie.

    heights.exr           the heights in texels, half floats: the row is x, to the right, and the column is y, upwards
    550nm_30deg.exr       its BRDF at 550 nm under light at 30 degrees from the normal, on the side of -x, on the grid
                          of views of maps/brdf_map.py, of any size; the row is x and the column is y
    550nm_30deg.seconds   its processor seconds, as text (optional)

`prepare` writes the heights, and `commands` are the lines of a shell that make the rest.
"""

import shlex
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from precompute.base.failure import GratingError
from precompute.base.machine import bundled
from precompute.maps.brdf_map import light_from
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import Relief, relief_of

HEIGHTS = "heights.exr"
# The grid of views. At 64 x 64, two neighbours in the middle are as far apart as a speckle is wide, at 550 nm.
_VIEWS = 64
_REMEDY = "run the lines that --prepare prints"


@dataclass(frozen=True)
class Question:
    """What both programs compute.

    texels       texels along each side of the surface; a power of two, because WaveOpticsBrdf cuts other sides
    texel_um     width of a texel. Above 0.05, WaveOpticsBrdf loses light
    sigma_um     standard deviation of the window's amplitude
    lights_deg   angles of the light from the normal, on the side of -x"""

    texels: int = 512
    texel_um: float = 65 / 1332
    sigma_um: float = 2.0
    wavelengths_nm: tuple[int, ...] = (400, 550, 700)
    lights_deg: tuple[int, ...] = (0, 30, 60)

    @property
    def centre_um(self) -> float:
        """The window's centre along both axes: the middle of the texel after the surface's middle."""
        return (self.texels // 2 + 0.5) * self.texel_um

    @property
    def cases(self) -> list[tuple[int, int]]:
        """Every wavelength with every light."""
        return [(nm, deg) for nm in self.wavelengths_nm for deg in self.lights_deg]


def prepare(folder: Path, question: Question, scan: HeightMap) -> None:
    """Write the middle of a scan as heights. Raises GratingError if the scan is too small."""
    count = question.texels
    if min(scan.height_m.shape) < count:
        raise GratingError(scan.source, f"fewer than {count} x {count} pixels", "take a larger scan")
    top, left = ((side - count) // 2 for side in scan.height_m.shape)
    middle = scan.height_m[top : top + count, left : left + count]
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / HEIGHTS, (middle - middle.mean())[::-1].T / (question.texel_um * 1e-6))


def commands(folder: Path, question: Question) -> list[str]:
    """The lines for bash that make the answers with WaveOpticsBrdf's genBrdf in the working folder."""
    path, centre = shlex.quote(str(folder)), f"{question.centre_um:.6f}"
    lines = ["export OMP_NUM_THREADS=1 TIMEFORMAT=%U"]
    for nm, deg in question.cases:
        x, _, z = light_from(np.radians(deg))
        lines.append(
            f"{{ time ./genBrdf -m Wave -d Kirchhoff -i {path}/{HEIGHTS} -o {path}/{_name(nm, deg)}.exr -w "
            f"{question.texel_um:.7f} -x {centre} -y {centre} -p {question.sigma_um:g} -l {nm / 1000:g} -s {x / z:.6f} "
            f"-r {_VIEWS} > {path}/log; }} 2> {path}/{_name(nm, deg)}.seconds"
        )
    return lines


def relief_in(folder: Path, question: Question) -> Relief:
    """The surface of both programs, whose edges wrap. Raises GratingError if its file is missing or of another size."""
    heights = _read(folder / HEIGHTS)
    if heights.shape != (question.texels, question.texels):
        raise GratingError(folder / HEIGHTS, f"not {question.texels} x {question.texels} texels", _REMEDY)
    pixel_m = question.texel_um * 1e-6
    return relief_of(HeightMap(heights.T[::-1] * pixel_m, (pixel_m, pixel_m), HEIGHTS, periodic=True))


def answer_in(folder: Path, nm: int, deg: int) -> tuple[np.ndarray, float | None]:
    """The BRDF (size, size) of WaveOpticsBrdf, row 0 at -y, and its seconds if the folder has them.

    Raises GratingError if the picture is missing or no square."""
    path = folder / f"{_name(nm, deg)}.exr"
    brdf = _read(path).T
    if brdf.shape[0] != brdf.shape[1]:
        raise GratingError(path, "not square", _REMEDY)
    try:
        seconds = float(path.with_suffix(".seconds").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return brdf, None
    return brdf, seconds


def write(path: Path, values: np.ndarray) -> None:
    """Write values (rows, columns) as three equal channels of half floats, as WaveOpticsBrdf reads and writes them."""
    OpenEXR = bundled("OpenEXR")
    halves = np.ascontiguousarray(values, np.float16)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, dict.fromkeys("RGB", halves)).write(str(path))


def _read(path: Path) -> np.ndarray:
    if not path.is_file():
        raise GratingError(path, "is missing", _REMEDY)
    try:
        found = bundled("OpenEXR").File(str(path), separate_channels=True).channels()["R"].pixels
    except (RuntimeError, KeyError) as error:
        raise GratingError(path, "not a picture with a red channel", _REMEDY) from error
    return found.astype(float)


def _name(nm: int, deg: int) -> str:
    return f"{nm}nm_{deg}deg"
