# SPDX-License-Identifier: GPL-3.0-or-later
"""Direction pairs on which an error is measured."""

from dataclasses import dataclass

import numpy as np

from ..optics.brdf import NO_RATIO, scattering_factor
from ..optics.region import Region


@dataclass(frozen=True)
class Pairs:
    """Unit vectors wi, wr (n, 3) to light and viewer, of one w; `drawn` (n,) marks pairs from the truth's spectrum."""

    wi: np.ndarray
    wr: np.ndarray
    drawn: np.ndarray

    @property
    def u(self) -> np.ndarray:
        """(n,), the component of wi + wr along T."""
        return self.wi[:, 0] + self.wr[:, 0]

    @property
    def v(self) -> np.ndarray:
        """(n,), the component of wi + wr along B."""
        return self.wi[:, 1] + self.wr[:, 1]

    def within(self, region: Region) -> "Pairs":
        """The pairs whose u and v lie in a region."""
        return self.only(region.contains(self.u, self.v))

    def only(self, kept: np.ndarray | slice) -> "Pairs":
        """The pairs that a mask (n,), a list of indices or a slice keeps."""
        return Pairs(self.wi[kept], self.wr[kept], self.drawn[kept])

    def radiance_factor(self, *, ratio_ior: float = NO_RATIO) -> np.ndarray:
        """The factor (n,) that turns scattered XYZ over w^2 into radiance under unit irradiance: for keratin's index of
        refraction, or in the ratio form of `ratio_ior` for light that holds its reflectance."""
        return scattering_factor(self.wi, self.wr, ratio_ior=ratio_ior)


def draw_w(count: int, rng: np.random.Generator, *, least: float = 0.0) -> np.ndarray:
    """Draw values of w = cos(ti) + cos(tr), (count,), distributed as for two cosine-weighted directions whose cosines
    are at least `least`.

    One value comes from each of `count` quantiles, so that a few values cover the range."""
    sums = np.sort(np.sqrt(least**2 + (1 - least**2) * rng.random((4096, 2))).sum(axis=1))
    return sums[((np.arange(count) + rng.random(count)) / count * len(sums)).astype(int)]


def cosine_weighted(
    w: float, count: int, rng: np.random.Generator, *, least: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Draw unit vectors wi, wr (count, 3) with cos(ti) + cos(tr) = w, both cosine weighted, at random azimuths. Their
    cosines are at least `least`."""
    low, high = max(least, w - 1), min(1.0, w - least)
    candidates = rng.uniform(low, high, 64 * count)
    # The cosine c of a cosine-weighted direction has the density 2 c, and its partner's cosine is w - c. Their joint
    # density is proportional to c (w - c), which peaks at c = w / 2.
    kept = candidates[rng.random(len(candidates)) * (w / 2) ** 2 < candidates * (w - candidates)]
    ci = kept[:count]
    azimuth = rng.uniform(0, 2 * np.pi, (2, len(ci)))
    return _direction(ci, azimuth[0]), _direction(w - ci, azimuth[1])


def _direction(cosine: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def pair_about(half: np.ndarray, rng: np.random.Generator, *, least: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Draw unit vectors wi and wr whose sums wi + wr are the vectors `half` (n, 3). Their cosines are above `least`.

    A vector of `half` without a pair after 200 trials is left out, so fewer than n pairs may be returned."""
    wi, wr, _ = pair_and_kept(half, rng, least=least)
    return wi, wr


def pair_and_kept(
    half: np.ndarray, rng: np.random.Generator, *, least: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Like pair_about. Also returns the indices of the vectors of `half` that have a pair."""
    length = np.linalg.norm(half, axis=1, keepdims=True)
    axis = half / length
    side = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(axis, side)
    reach = np.sqrt(np.maximum(1 - length**2 / 4, 0))
    offset = np.zeros_like(half)
    pending = np.arange(len(half))
    for _ in range(200):
        turn = rng.uniform(0, 2 * np.pi, (len(pending), 1))
        trial = reach[pending] * (np.cos(turn) * side[pending] + np.sin(turn) * up[pending])
        above = np.abs(trial[:, 2]) < half[pending, 2] / 2 - least
        offset[pending[above]] = trial[above]
        pending = pending[~above]
        if len(pending) == 0:
            break
    kept = np.setdiff1d(np.arange(len(half)), pending)
    return (half / 2 + offset)[kept], (half / 2 - offset)[kept], kept
