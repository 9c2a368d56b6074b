# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's photographs of diffracted beams, and the comparison of one of them with a computed picture."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.table.table import Table

from .photographs_hues import HUES, Band, beam_centre, distances, linear, luminances
from .photographs_screen import Laboratory, picture

# Distances (n,) of slabs, by band and hue.
Places = dict[tuple[str, str], np.ndarray]
# A ratio of the distances of two bands' hues: band and hue over band and hue.
Ratio = tuple[tuple[str, str], tuple[str, str]]
# A camera's white balance is unknown. This is the change of red, and of blue, whose effect is reported.
_BALANCE = 1.1
# The computed picture's brightest place outside of the beam, so that the beam alone is burnt.
_EXPOSURE = 0.8
# Millimetres per pixel to start from, and how often they are corrected; two corrections leave 0.3 %.
_SCALE, _CORRECTIONS = 0.1, 2


@dataclass(frozen=True)
class Photograph:
    """A photograph and how it is read.

    beam       the columns that hold the beam's spot, burnt to white
    bands      its orders
    scaled_by  the bands whose distances set the scale of the computed picture
    ratios     of distances, that are compared
    unburnt    the bands whose brightness can be compared
    mirrored   whether the orders are at the left
    along_b    whether the orders lie along the scan's B axis; else along T"""

    name: str
    skin: str
    beam: slice
    bands: tuple[Band, ...]
    scaled_by: tuple[str, ...]
    ratios: tuple[Ratio, ...]
    unburnt: tuple[str, ...]
    mirrored: bool = False
    along_b: bool = False


def named(ratio: Ratio) -> str:
    """A ratio in words, "above yellow / along yellow"."""
    return " / ".join(" ".join(key) for key in ratio)


def _same_hue(bands: tuple[str, ...], over: str) -> tuple[Ratio, ...]:
    return tuple(((band, hue), (over, hue)) for band in bands for hue in ("yellow", "green", "cyan"))


def _over_yellow(*bands: str) -> tuple[Ratio, ...]:
    return tuple(((b, hue), (b, "yellow")) for b in bands for hue in ("orange", "green", "cyan", "azure"))


ELAPHE = Photograph(
    "experiment__elaphe_g2", "elaphe", slice(150, 260),
    (Band("along", 240, 690, 30), Band("above", 85, 170, 30, "up"), Band("below", 85, 170, 30, "down")),
    ("along",), _same_hue(("above", "below"), "along") + _over_yellow("along"), ("above", "below"),
)  # fmt: skip
XENOPELTIS = Photograph(
    "experiment__xenopeltis_white_beam", "xenopeltis", slice(20, 140),
    (Band("first", 110, 300, 100), Band("second", 300, 650, 100)),
    ("first", "second"), _same_hue(("second",), "first") + _over_yellow("first", "second"),
    ("second",), mirrored=True, along_b=True,
)  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """A photograph's distances, and those in a picture `light` (rows, columns, 3) of the same size."""

    photographed: Places
    light: np.ndarray
    predicted: Places

    @cached_property
    def means(self) -> dict[tuple[str, str], tuple[float, float]]:
        """Mean distances, photographed and predicted, over the slabs that have both."""
        return {key: (theirs.mean(), ours.mean()) for key, theirs, ours in common(self.photographed, self.predicted)}

    def scale(self, bands: tuple[str, ...]) -> float:
        """Predicted over photographed distances of some bands, the geometric mean."""
        logs = [np.log(ours / theirs) for (band, _), (theirs, ours) in self.means.items() if band in bands]
        return float(np.exp(np.mean(logs)))

    def ratio(self, ratio: Ratio) -> tuple[float, float]:
        """A ratio, photographed and predicted; NaN where a hue was not found."""
        (above, ours_above), (below, ours_below) = (self.means.get(key, (np.nan, np.nan)) for key in ratio)
        return above / below, ours_above / ours_below


def read(folder: Path, one: Photograph) -> np.ndarray:
    """Linear light (rows, columns, 3) of a photograph in a folder, its orders to the right."""
    light = linear(np.asarray(Image.open(folder / f"{one.name}.png").convert("RGB"), float) / 255)
    return light[:, ::-1] if one.mirrored else light


def measured(light: np.ndarray, one: Photograph, beam: tuple[float, float]) -> Places:
    """All distances from the beam in a photograph's bands, in a picture of the same size."""
    found = {band.name: distances(light, beam, band) for band in one.bands}
    return {(band, hue): where for band, hues in found.items() for hue, where in hues.items()}


def common(first: Places, second: Places) -> Iterator[tuple[tuple[str, str], np.ndarray, np.ndarray]]:
    """Two pictures' distances in the slabs that have both, for each band and hue."""
    for key, distances_there in first.items():
        both = np.isfinite(distances_there) & np.isfinite(second[key])
        if both.any():
            yield key, distances_there[both], second[key][both]


def compared(table: Table, photograph: np.ndarray, one: Photograph, laboratory: Laboratory) -> Comparison:
    """The comparison of a photograph with our picture on the same pixels.

    One number is fitted, the scale: the mean distance in the bands `scaled_by` becomes the photograph's."""
    beam = beam_centre(photograph, one.beam)
    places = measured(photograph, one, beam)
    start = round(beam[1]) + one.bands[0].near
    mm_per_pixel = _SCALE
    for _ in range(_CORRECTIONS + 1):
        light = picture(table, laboratory, photograph.shape[:2], beam=beam, mm_per_pixel=mm_per_pixel)
        light *= _EXPOSURE / light[:, start:].max()
        comparison = Comparison(places, light, measured(light, one, beam_centre(light, one.beam)))
        mm_per_pixel *= comparison.scale(one.scaled_by)
    return comparison


def brightnesses(light: np.ndarray, one: Photograph, places: Places) -> dict[str, dict[str, float]]:
    """Luminance of each hue over that of green, in each unburnt band of a picture with these distances."""
    beam, found = beam_centre(light, one.beam), {}
    for band in (band for band in one.bands if band.name in one.unburnt):
        means = {hue: np.nanmean(luminances(light, beam, band, places[band.name, hue])) for hue in HUES}
        found[band.name] = {hue: float(mean / means["green"]) for hue, mean in means.items()}
    return found


def rebalanced(photograph: np.ndarray, one: Photograph) -> list[Places]:
    """The photograph's distances if the camera's red, or its blue, were 10 % stronger."""
    # The other channels become weaker, so that nothing counts as burnt that was not.
    gains = (np.where(np.arange(3) == channel, 1, 1 / _BALANCE) for channel in (0, 2))
    beam = beam_centre(photograph, one.beam)
    return [measured(photograph * gain, one, beam) for gain in gains]
