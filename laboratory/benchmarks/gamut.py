# SPDX-License-Identifier: GPL-3.0-or-later
"""How far colours of diffraction lie outside of a renderer's space, and what mapping them into it costs.

    ./dev bench gamut [--json FILE|-]

A spectrum's colour has negative components in every RGB space. The materials cut each of them to 0, which adds light.
The benchmark draws directions of lamp and viewer by the light that a bake sends there, without its mirror image, and
shows each colour at Y = 0.3. It compares the cut with two others: desaturation towards the grey of the same luminance,
and the colour of the space with the least difference, found by search. The scans of skins are in shared/data beside the
repository; where it is absent, samples stand for them.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.cli.parser import OneLineParser
from precompute.colour.difference import delta_e_2000, lab
from precompute.colour.observer import white_xyz
from precompute.colour.working_space import RGB_SPACES, rgb_from_xyz
from precompute.presets.presets import read_preset
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.radiance import reflected_xyz
from precompute.table.table import Table

from ..speed.surfaces import SHARED, SKINS, skin
from ..study.pages import table
from . import report

SHOWN_Y = 0.3
# Directions that are tried, and colours that are drawn from them.
_TRIED, _DRAWN = 100_000, 500
# Within this many standard deviations of the kernel, light counts as the mirror image.
_MIRROR = 5.0
# The search around a colour in Lab: changes of lightness, factors on chroma, and turns of hue in degrees.
_LIGHTNESS, _CHROMA, _HUE_DEG = np.linspace(-30, 30, 21), np.linspace(0.1, 1.1, 41), np.linspace(-40, 40, 33)


@dataclass(frozen=True)
class Row:
    """A surface in a space. Errors are CIEDE2000 of the colours outside of the space: median and 95th percentile.

    outside   share of the light whose colours are outside
    light     luminance after the cut over luminance before it, of all light"""

    surface: str
    space: str
    outside: float
    light: float
    cut: tuple[float, float]
    grey: tuple[float, float]
    least: tuple[float, float]


def cut(rgb: np.ndarray) -> np.ndarray:
    """Negative components as 0, as the materials do."""
    return np.maximum(rgb, 0)


def towards_grey(rgb: np.ndarray, luminance: np.ndarray) -> np.ndarray:
    """Colours (n, 3) moved towards the grey of the same luminance until no component is negative. `luminance` (3,) are
    the space's weights."""
    y = (rgb @ luminance)[:, None]
    lowest = np.minimum(rgb.min(axis=1, keepdims=True), 0)
    return y + y / (y - lowest) * (rgb - y)


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


def colours_of(baked: Table, rng: np.random.Generator) -> np.ndarray:
    """Colours (n, 3) in XYZ that a surface shows, drawn by their light, at Y = SHOWN_Y."""
    turn, square = 2 * np.pi * rng.random((2, _TRIED)), rng.random((2, _TRIED))
    sine = np.sqrt(square)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - square)], axis=-1)
    xyz = reflected_xyz(baked, wi, wr)
    u, v = (wi + wr)[:, :2].T
    weight = np.where(np.hypot(u, v) > _MIRROR * baked.sigma_b, np.maximum(xyz[:, 1], 0), 0)
    drawn = xyz[rng.choice(_TRIED, _DRAWN, p=weight / weight.sum())]
    return SHOWN_Y * drawn / drawn[:, 1:2]


def row_of(surface: str, xyz: np.ndarray, space: str) -> Row:
    """Compare the mappings of colours (n, 3) in XYZ into a space."""
    to_rgb = rgb_from_xyz(space)
    to_xyz = np.linalg.inv(to_rgb)
    rgb = xyz @ to_rgb.T
    outside = (rgb < 0).any(axis=1)

    def errors(mapped: np.ndarray) -> np.ndarray:
        white = white_xyz()
        return delta_e_2000(lab(mapped[outside] @ to_xyz.T, white), lab(xyz[outside], white))

    of_cut, of_grey = errors(cut(rgb)), errors(towards_grey(rgb, to_xyz[1]))
    # The search has steps, so a mapping may come nearer.
    least = np.minimum(nearest(xyz[outside], to_rgb), np.minimum(of_cut, of_grey))
    light = float((cut(rgb) @ to_xyz[1]).sum() / xyz[:, 1].sum())
    return Row(surface, space, float(outside.mean()), light, *map(_middle_and_rest, (of_cut, of_grey, least)))


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
        xyz = colours_of(baked, np.random.default_rng(0))
        rows += [row_of(surface, xyz, space) for space in RGB_SPACES]
    report.say(
        table(
            ["surface", "space", "light outside", "light after the cut", "cut", "towards grey", "least"],
            [
                [row.surface, row.space, f"{row.outside:.0%}", f"{row.light:.3f}"]
                + [f"{middle:.1f} / {rest:.1f}" for middle, rest in (row.cut, row.grey, row.least)]
                for row in rows
            ],
        ),
        arguments.json,
    )
    report.write({"rows": [asdict(row) for row in rows]}, arguments.json)


if __name__ == "__main__":
    main()
