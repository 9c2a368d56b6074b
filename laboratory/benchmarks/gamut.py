# SPDX-License-Identifier: GPL-3.0-or-later
"""How far colours of diffraction lie outside of a renderer's space, and what mapping them into it costs.

    ./dev bench gamut [--json FILE|-]

A spectrum's colour has negative components in every RGB space. The materials move such a colour towards the grey of
the same luminance (precompute/colour/spaces.py). The benchmark draws directions of lamp and viewer by the light that a
bake sends there, without its mirror image, and shows each colour at Y = 0.3. It compares what is shown with two others:
each negative component cut to 0, and the colour of the space with the least difference, found by search. The materials
map each lamp's colour before the sum. "Three lamps" are the means of three colours from different directions: mapped
each, as in the materials, and mapped once as a sum. The scans of skins are in shared/data beside the repository; where
it is absent, samples stand for them.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.bake.self_check import colours_by_light
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import RGB_SPACES, delta_e_2000, lab, rgb_from_xyz, shown_rgb
from precompute.presets.presets import read_preset
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.table import Table

from ..speed.surfaces import SHARED, SKINS, skin
from ..study.pages import table
from . import report

# Pairs of directions that colours are drawn from.
_TRIED = 100_000
# The search around a colour in Lab: changes of lightness, factors on chroma, and turns of hue in degrees.
_LIGHTNESS, _CHROMA, _HUE_DEG = np.linspace(-30, 30, 21), np.linspace(0.1, 1.1, 41), np.linspace(-40, 40, 33)


@dataclass(frozen=True)
class Row:
    """A surface in a space. Errors are CIEDE2000 of the colours outside of the space: median and 95th percentile.

    outside   share of the light whose colours are outside
    light     luminance over the spectra's, of all light: as shown, and after the cut
    three     of three lamps whose sum is outside: mapped each, and mapped as a sum"""

    surface: str
    space: str
    outside: float
    light: tuple[float, float]
    shown: tuple[float, float]
    cut: tuple[float, float]
    least: tuple[float, float]
    three: tuple[tuple[float, float], tuple[float, float]]


def cut(rgb: np.ndarray) -> np.ndarray:
    """Negative components as 0."""
    return np.maximum(rgb, 0)


def nearest(xyz: np.ndarray, to_rgb: np.ndarray) -> np.ndarray:
    """The difference (n,) of colours (n, 3) from the nearest colour of a space, by a search in Lab."""
    white = white_xyz()
    lightness, chroma, turn = np.meshgrid(_LIGHTNESS, _CHROMA, np.radians(_HUE_DEG), indexing="ij")
    turned = np.exp(1j * turn.ravel()) * chroma.ravel()
    found = []
    for given in lab(xyz, white):
        moved = (given[1] + 1j * given[2]) * turned
        tried = np.stack([given[0] + lightness.ravel(), moved.real, moved.imag], axis=-1)
        inside = (_xyz_of_lab(tried, white) @ to_rgb.T >= -1e-9).all(axis=1)
        found.append(delta_e_2000(tried[inside], np.broadcast_to(given, tried[inside].shape)).min(initial=np.inf))
    return np.array(found)


def _xyz_of_lab(given: np.ndarray, white: np.ndarray) -> np.ndarray:
    """The inverse of CIE Lab (ISO/CIE 11664-4)."""
    y = (given[:, 0] + 16) / 116
    f = np.stack([y + given[:, 1] / 500, y, y - given[:, 2] / 200], axis=-1)
    return white * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))


def row_of(surface: str, xyz: np.ndarray, space: str) -> Row:
    """Compare the mappings of colours (n, 3) in XYZ into a space."""
    to_rgb = rgb_from_xyz(space)
    to_xyz = np.linalg.inv(to_rgb)
    outside = _outside(xyz, to_rgb)

    def errors(mapped: np.ndarray, true: np.ndarray) -> np.ndarray:
        return delta_e_2000(lab(mapped @ to_xyz.T, white_xyz()), lab(true, white_xyz()))

    shown, cut_off = shown_rgb(xyz, to_rgb), cut(xyz @ to_rgb.T)
    of_shown, of_cut = (errors(mapped[outside], xyz[outside]) for mapped in (shown, cut_off))
    # The search has steps, so a mapping may come nearer.
    least = np.minimum(nearest(xyz[outside], to_rgb), np.minimum(of_cut, of_shown))
    light = tuple(float((mapped @ to_xyz[1]).sum() / xyz[:, 1].sum()) for mapped in (shown, cut_off))
    sums, mapped_each = (_mean_of_three(each) for each in (xyz, shown))
    far = _outside(sums, to_rgb)
    three = errors(mapped_each[far], sums[far]), errors(shown_rgb(sums[far], to_rgb), sums[far])
    parts = map(_middle_and_rest, (of_shown, of_cut, least))
    return Row(surface, space, float(outside.mean()), light, *parts, tuple(map(_middle_and_rest, three)))


def _outside(xyz: np.ndarray, to_rgb: np.ndarray) -> np.ndarray:
    return (xyz @ to_rgb.T < 0).any(axis=1)


def _mean_of_three(colours: np.ndarray) -> np.ndarray:
    return (colours + np.roll(colours, 1, axis=0) + np.roll(colours, 2, axis=0)) / 3


def _middle_and_rest(errors: np.ndarray) -> tuple[float, float]:
    return (float(np.median(errors)), float(np.percentile(errors, 95))) if len(errors) else (0.0, 0.0)


def bakes() -> Iterator[tuple[str, Table]]:
    """The surfaces, each with its table."""
    for name in ("cd", "dvd"):
        request = read_preset(name).request
        yield name.upper(), bake(prepare(request.scans[0].read()), request)
    yield "blaze", bake(prepare(blazed()), BakeRequest())
    for name in SKINS:
        yield name.capitalize(), bake(prepare(skin(SHARED, name)), BakeRequest())


def main(argv: list[str] | None = None) -> None:
    """Print a table of the surfaces in all spaces."""
    parser = OneLineParser(prog="./dev bench gamut", description=__doc__.splitlines()[0])
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    rows = []
    for surface, baked in bakes():
        xyz = colours_by_light(baked, np.random.default_rng(0), _TRIED)
        rows += [row_of(surface, xyz, space) for space in RGB_SPACES]
    report.say(
        table(
            [
                "surface", "space", "light outside", "light as shown", "after a cut", "as shown", "cut", "least",
                "three lamps, each", "as a sum",
            ],
            [
                [row.surface, row.space, f"{row.outside:.0%}", *(f"{light:.3f}" for light in row.light)]
                + [f"{middle:.1f} / {rest:.1f}" for middle, rest in (row.shown, row.cut, row.least, *row.three)]
                for row in rows
            ],
        ),
        arguments.json,
    )  # fmt: skip
    report.write({"rows": [asdict(row) for row in rows]}, arguments.json)


if __name__ == "__main__":
    main()
