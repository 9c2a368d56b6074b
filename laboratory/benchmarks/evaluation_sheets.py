# SPDX-License-Identifier: GPL-3.0-or-later
"""How well our maps agree with the thesis's pictures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from .evaluation_maps import Map

# The share of a thesis's picture, from its edge, at which the disc of views begins: 19 of 800 pixels.
DISC_MARGIN = 19 / 800
# Agreement is taken between these distances from the normal: the middle of the disc clips, and its edge is drawn in
# white.
RING = (0.1, 0.95)


@dataclass(frozen=True)
class Agreement:
    """Rank correlations of a map with the thesis's picture, in red, green and blue, as it is and turned by half a
    turn."""

    name: str
    caption: str
    thesis: str
    upright: list[float]
    turned: list[float]


def agreements(wanted: dict[str, list[Map]], images: Path, shared: Path) -> list[Agreement]:
    """The agreement of every map of a skin that shows something beside its specular middle with the thesis's."""
    skins = ("elaphe", "xenopeltis", "taylor-elaphe", "taylor-xenopeltis", "incidence-xenopeltis")
    found = []
    for one in (one for name in skins for one in wanted[name]):
        path = shared / "thesis_figures" / f"{one.thesis}.png"
        if not one.thesis or not path.is_file() or one.changes.get("terms") == 1:
            continue
        ours = np.asarray(Image.open(images / f"{one.name}.png").convert("RGB"))
        theirs = np.asarray(disc(path, len(ours)))
        turned = ours[::-1, ::-1]
        found.append(
            Agreement(one.name, one.caption, one.thesis, agreement(ours, theirs), agreement(turned, theirs))
        )  # fmt: skip
    return found


def agreement(ours: np.ndarray, theirs: np.ndarray) -> list[float]:
    """Spearman's rank correlation of two maps (n, n, 3), for each channel.

    Ranks do not depend on exposure or gamma, which the thesis does not tell. The left half of the ring RING is taken,
    because some of the thesis's pictures hold an inset in the right half."""
    axis = (np.arange(len(ours)) + 0.5) * 2 / len(ours) - 1
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    inside = (radius > RING[0]) & (radius < RING[1]) & (x < 0)
    pairs = ((ranks(ours[inside, c]), ranks(theirs[inside, c])) for c in range(3))
    return [float(np.corrcoef(*pair)[0, 1]) for pair in pairs]


def ranks(values: np.ndarray) -> np.ndarray:
    """The rank of each of the values (n,); equal values share the mean of their ranks."""
    _, which, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[which.ravel()]


def disc(path: Path, pixels: int) -> Image.Image:
    """The disc of views of a picture of the thesis, over white, resized to a square."""
    picture = Image.open(path).convert("RGBA")
    white = Image.new("RGBA", picture.size, "white")
    white.alpha_composite(picture)
    margin = round(DISC_MARGIN * picture.width)
    inner = white.convert("RGB").crop((margin, margin, picture.width - margin, picture.height - margin))
    return inner.resize((pixels, pixels), Image.Resampling.BOX)
