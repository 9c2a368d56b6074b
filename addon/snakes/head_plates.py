# SPDX-License-Identifier: GPL-3.0-or-later
"""The outlines of a snake's head plates.

Corners are shares of the head's length from the snout and degrees from the midline of its top. Outlines are those of
one side; a plate on the midline continues on the other side. Neighbours share their corners, so there are no gaps. The
names of the plates are those of colubrid snakes; between the parietals of Xenopeltis lies an interparietal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Corner = tuple[float, float]
# The angle of the line of the mouth at the snout, and the upper edge of the lips.
MOUTH_DEG, LIP_DEG = 104.0, 86.0
# The snout is round: without corners along the mouth the edge of the rostral would cut it short.
_ROSTRAL = (
    (0.0, 0), (0.085, 0), (0.075, 32), (0.07, 66), (0.08, LIP_DEG), (0.08, MOUTH_DEG), (0.05, MOUTH_DEG),
    (0.025, MOUTH_DEG), (0.01, MOUTH_DEG),
)  # fmt: skip
_INTERNASAL = ((0.085, 0), (0.175, 0), (0.165, 30), (0.15, 44), (0.075, 32))
_NASAL = ((0.075, 32), (0.15, 44), (0.165, 60), (0.16, LIP_DEG), (0.08, LIP_DEG), (0.07, 66))
_PREFRONTAL = ((0.175, 0), (0.31, 0), (0.305, 28), (0.28, 52), (0.165, 60), (0.15, 44), (0.165, 30))
_LOREAL = ((0.165, 60), (0.28, 52), (0.285, 68), (0.28, LIP_DEG), (0.16, LIP_DEG))
_FRONTAL = ((0.31, 0), (0.305, 28), (0.36, 31), (0.46, 25), (0.55, 0))
_SUPRAOCULAR = ((0.305, 28), (0.36, 31), (0.46, 25), (0.48, 42), (0.405, 54), (0.28, 52))
_OCULAR = ((0.28, 52), (0.405, 54), (0.40, 70), (0.39, LIP_DEG), (0.28, LIP_DEG), (0.285, 68))
_POSTOCULAR = ((0.405, 54), (0.48, 42), (0.53, 56), (0.52, LIP_DEG), (0.39, LIP_DEG), (0.40, 70))
_TEMPORAL = ((0.53, 56), (0.66, 52), (0.68, LIP_DEG), (0.52, LIP_DEG))
_REAR_TEMPORAL = ((0.66, 52), (0.80, 36), (0.84, 60), (0.82, LIP_DEG), (0.68, LIP_DEG))
_INTERPARIETAL = ((0.55, 0), (0.64, 15), (0.78, 12), (0.84, 0))
_BESIDE_INTERPARIETAL = (
    (0.55, 0), (0.46, 25), (0.48, 42), (0.53, 56), (0.66, 52), (0.80, 36), (0.84, 0), (0.78, 12), (0.64, 15)
)  # fmt: skip
_PARIETAL = ((0.55, 0), (0.46, 25), (0.48, 42), (0.53, 56), (0.66, 52), (0.80, 36), (0.82, 0))
_LABIAL_ENDS = (0.08, 0.16, 0.22, 0.28, 0.39, 0.52, 0.60, 0.68, 0.82)
# Centres of the small scales without outlines: lower lips, chin, throat, and behind the plates.
_SMALL = np.array((
    (0.06, 128), (0.18, 122), (0.31, 120), (0.45, 119), (0.60, 118), (0.76, 118), (0.92, 118),
    (0.04, 180), (0.20, 158), (0.42, 156), (0.64, 158), (0.84, 160), (0.52, 180), (0.74, 180), (0.94, 180),
    (0.90, 0), (0.89, 22), (0.90, 44), (0.91, 66), (0.90, 88), (0.99, 11), (0.99, 33), (0.99, 55), (0.99, 77),
    (0.99, 99),
))  # fmt: skip


class Plates(NamedTuple):
    """The plates of one side of a head: outlines, how many of the first lie on the midline, and the centres of small
    scales (k, 2): share and degrees."""

    outlines: tuple[tuple[Corner, ...], ...]
    on_midline: int
    small: np.ndarray

    @property
    def lie_on_midline(self) -> np.ndarray:
        """Whether each plate, then each small scale, is one for both sides."""
        return np.concatenate([np.arange(len(self.outlines)) < self.on_midline, self.small[:, 1] % 180 == 0])


def _plates(*, interparietal: bool) -> Plates:
    labials = tuple(
        ((front, LIP_DEG), (rear, LIP_DEG), (rear, MOUTH_DEG), (front, MOUTH_DEG))
        for front, rear in zip(_LABIAL_ENDS, _LABIAL_ENDS[1:], strict=False)
    )
    middle = (_ROSTRAL, _FRONTAL, _INTERPARIETAL) if interparietal else (_ROSTRAL, _FRONTAL)
    pairs = (
        _INTERNASAL, _NASAL, _PREFRONTAL, _LOREAL, _SUPRAOCULAR, _OCULAR, _POSTOCULAR, _TEMPORAL, _REAR_TEMPORAL,
        _BESIDE_INTERPARIETAL if interparietal else _PARIETAL,
    )  # fmt: skip
    return Plates((*middle, *pairs, *labials), len(middle), _SMALL)


XENOPELTIS, ELAPHE = _plates(interparietal=True), _plates(interparietal=False)
