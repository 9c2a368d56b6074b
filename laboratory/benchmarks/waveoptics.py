# SPDX-License-Identifier: GPL-3.0-or-later
"""WaveOpticsBrdf (Yan and others 2018) beside our patch model, on one surface under one window.

    ./dev bench waveoptics FOLDER --prepare          write the heights, and print the lines that fill the folder
    ./dev bench waveoptics FOLDER [--output DIR] [--json FILE|-]

waveoptics_folder.py describes the folder, and docs/against_the_world.md says how to build WaveOpticsBrdf, of which this
project holds no line. Its Kirchhoff model has the light of ours times Stam's obliquity, for a surface that reflects
all light. Compared are its pictures, our exact sums (`reference-patch`), and our patch bake of each wavelength.
A difference is the sum of |d| over all views over the sum of ours. The grid is uniform on the unit disc, so such a sum
is reflected energy. Its window ends at 3 standard deviations, ours at 7.5, so the sums with our window cut alike are
compared, too. With --output, a picture is written for each wavelength.
"""

import time
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli.parser import OneLineParser
from precompute.colour.spaces import srgb_encode
from precompute.maps.brdf_map import light_from, view_hemisphere
from precompute.optics.brdf import obliquity_times_cosine_and_w2
from precompute.reference.reference import PatchReference
from precompute.spectra.spectrum import PatchWindow, phasor, window_at
from precompute.table.table import Table

from ..speed.surfaces import SHARED, skin
from ..study.pages import table
from . import report
from .waveoptics_folder import Question, answer_in, commands, prepare, relief_in

# WaveOpticsBrdf leaves out texels beyond so many standard deviations from the window's centre.
_CUT = 3.0
# The colour error that our bakes may have. Wavelengths of 400 and 700 nm are hard: the eye hardly sees them.
_DELTA_E = 2.0
# Differences are shown so many times as bright.
_LOUDER = 10.0
# Side of a BRDF in the picture.
_PIXELS = 256


@dataclass(frozen=True)
class Row:
    """One wavelength and one light.

    theirs, cut, baked   differences from our sums: of WaveOpticsBrdf, of our sums with the window cut as its own, and
                         of our bake
    beyond_cut           the difference of WaveOpticsBrdf from our sums with the window cut
    at_equal_light       the same, if WaveOpticsBrdf had as much light
    energy               the light of WaveOpticsBrdf over that of our sums
    seconds              of WaveOpticsBrdf (None if unknown), of our sums, of our bake, and of reading the bake"""

    nm: int
    light_deg: int
    theirs: float
    cut: float
    beyond_cut: float
    at_equal_light: float
    baked: float
    energy: float
    seconds: tuple[float | None, float, float, float]


@dataclass(frozen=True)
class Views:
    """The light's direction, and directions of view on a grid."""

    wi: np.ndarray
    wr: np.ndarray
    inside: np.ndarray

    @property
    def uvw(self) -> np.ndarray:
        """u, v and w (3, n)."""
        return (self.wi + self.wr[self.inside]).T

    def brdf(self, density: np.ndarray) -> np.ndarray:
        """The BRDF (size, size) of a density (n,), with Stam's obliquity; 0 outside the hemisphere."""
        factor = obliquity_times_cosine_and_w2(self.wi, self.wr[self.inside])
        image = np.zeros(self.inside.shape)
        image[self.inside] = density * factor / (self.wi[2] * self.uvw[2] ** 2)
        return image


def cut_density(window: PatchWindow, u: np.ndarray, v: np.ndarray, w: np.ndarray, lam: float) -> np.ndarray:
    """PatchReference.density of one copy of the patch, under a window that ends at _CUT standard deviations."""
    y, x = window.positions(0)[:, None], window.positions(1)
    radius2 = (x**2 + y**2) / window.sigma_m**2
    kept = np.where(radius2 <= _CUT**2, np.exp(-0.5 * radius2), 0.0)
    along_y, along_x = (np.exp(-2j * np.pi * np.outer(q / lam, at)) for q, at in ((v, y), (u, x)))
    amplitude = np.empty(len(u), complex)
    for one in np.unique(w):
        at = w == one
        field = kept * phasor(window.relief.height_m, one / lam)
        amplitude[at] = np.einsum("ny,yn->n", along_y[at], field @ along_x[at].T)
    return window.density_scale() * np.abs(amplitude) ** 2 / lam**2


def bakes(folder: Path, question: Question) -> dict[int, tuple[Table, float]]:
    """For each wavelength the table of our patch bake, and the seconds of making it and of its self-check."""
    relief, found = relief_in(folder, question), {}
    for nm in question.wavelengths_nm:
        request = BakeRequest(
            delta_e=_DELTA_E, coherence_length_m=4e-6 * question.sigma_um, illuminant=f"{nm}nm", model="patch",
            patch_um=(question.centre_um, question.centre_um),
        )  # fmt: skip
        made = make([relief], request)
        found[nm] = made.table, made.seconds + made.check_seconds
    return found


def compared(
    folder: Path, question: Question, nm: int, *, deg: int, bake: tuple[Table, float]
) -> tuple[Row, np.ndarray, np.ndarray]:
    """Compare one picture of the folder. Returns its figures, its BRDF, and ours."""
    theirs, their_seconds = answer_in(folder, nm, deg)
    window = window_at(relief_in(folder, question), question.sigma_um * 1e-6, (question.centre_um, question.centre_um))
    views = Views(light_from(np.radians(deg)), *view_hemisphere(len(theirs)))
    # Views at the same angle from the normal have the same w, so that their sums share a phasor.
    u, v, w = views.uvw
    w, lam = np.round(w, 9), nm * 1e-9
    started = time.process_time()
    ours = views.brdf(PatchReference(window).density(u, v, w, wavelength_m=lam))
    summed = time.process_time()
    # The luminance of a laser's line is its density, because the white mirror has Y = 1.
    baked = views.brdf(bake[0].scattered_over_w2(u, v, w)[:, 1] * w**2)
    read = time.process_time()
    cut = views.brdf(cut_density(window, u, v, w, lam))
    theirs = np.where(views.inside, theirs, 0)
    of_ours = partial(_difference, of=ours)
    row = Row(
        nm, deg, of_ours(theirs), of_ours(cut), _difference(theirs, of=cut),
        _difference(theirs * (cut.sum() / theirs.sum()), of=cut), of_ours(baked), theirs.sum() / ours.sum(),
        (their_seconds, summed - started, bake[1], read - summed),
    )  # fmt: skip
    return row, theirs, ours


def _difference(image: np.ndarray, *, of: np.ndarray) -> float:
    return float(np.abs(image - of).sum() / of.sum())


def tables(rows: list[Row]) -> tuple[str, str]:
    """The figures and the seconds, in Markdown."""
    differences = ["theirs", "our window cut", "theirs to ours, cut", "at equal light", "our bake"]
    header = ["wavelength", "light", *differences, "energy"]
    seconds = ["wavelength", "light", "theirs", "our sums", "our bake", "reading it"]
    cases = [[f"{row.nm} nm", f"{row.light_deg} degrees"] for row in rows]
    figures = [
        [f"{one:.1%}" for one in (row.theirs, row.cut, row.beyond_cut, row.at_equal_light, row.baked)]
        + [f"{row.energy:.3f}"]
        for row in rows
    ]
    times = [["-" if one is None else f"{one:.2g}" for one in row.seconds] for row in rows]
    one, two = (
        table(head, [case + cells for case, cells in zip(cases, columns, strict=True)])
        for head, columns in ((header, figures), (seconds, times))
    )
    return one, two


def sheet(pairs: list[tuple[np.ndarray, np.ndarray]]) -> Image.Image:
    """A row for each pair of BRDFs: theirs, ours, and the difference, _LOUDER times: red where theirs is brighter, blue
    where ours is. Each row has its own exposure."""
    return Image.fromarray(np.concatenate([_row(*pair) for pair in pairs]))


def _row(theirs: np.ndarray, ours: np.ndarray) -> np.ndarray:
    white = np.percentile(ours[ours > 0], 99)
    off = _LOUDER * (theirs - ours) / white
    parts = [np.stack([each / white] * 3, axis=-1) for each in (theirs, ours)]
    parts.append(np.stack([off, np.zeros_like(off), -off], axis=-1))
    picture = srgb_encode(np.clip(np.concatenate(parts, axis=1)[::-1], 0, 1))
    repeats = max(1, _PIXELS // len(ours))
    return np.rint(255 * picture).astype(np.uint8).repeat(repeats, axis=0).repeat(repeats, axis=1)


def main(argv: list[str] | None = None) -> None:
    """Print the tables, or prepare the folder."""
    parser = OneLineParser(prog="./dev bench waveoptics", description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help="with the output of WaveOpticsBrdf")
    parser.add_argument("--prepare", action="store_true", help="write the heights, and print the lines of the recipe")
    parser.add_argument("--output", type=Path, metavar="DIR", help="write the pictures here")
    parser.add_argument("--shared", type=Path, default=SHARED, metavar="DIR")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if arguments.folder is None:
        recipe = "`./dev bench waveoptics FOLDER --prepare` says how to make it"
        report.say(f"skipped: needs a FOLDER with the output of WaveOpticsBrdf; {recipe}", arguments.json)
        return
    try:
        if arguments.prepare:
            prepare(arguments.folder, Question(), skin(arguments.shared, "elaphe"))
            report.say("\n".join(commands(arguments.folder.resolve(), Question())), arguments.json)
        else:
            _compare(arguments.folder, Question(), arguments.output, arguments.json)
    except GratingError as error:
        parser.error(str(error))


def _compare(folder: Path, question: Question, output: Path | None, target: str | None) -> None:
    for nm, deg in question.cases:
        answer_in(folder, nm, deg)  # fail before the bakes
    baked = bakes(folder, question)
    found = {(nm, deg): compared(folder, question, nm, deg=deg, bake=baked[nm]) for nm, deg in question.cases}
    rows = [row for row, *_ in found.values()]
    report.say("\n\n".join(tables(rows)), target)
    report.write({"rows": [asdict(row) for row in rows]}, target)
    if output:
        output.mkdir(parents=True, exist_ok=True)
        for nm in question.wavelengths_nm:
            pairs = [found[nm, deg][1:] for deg in question.lights_deg]
            sheet(pairs).save(output / f"beside_waveoptics_{nm}nm.png")


if __name__ == "__main__":
    main()
