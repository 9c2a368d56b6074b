# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads pictures between their pixels by cubic convolution (Keys, IEEE Transactions on Acoustics, Speech, and Signal
Processing 29, 1981), which is exact for quadratic surfaces."""

import numpy as np


def read_between(image: np.ndarray, row: np.ndarray, col: np.ndarray) -> np.ndarray:
    """The image (rows, columns) at places that count in its pixels, from 4 x 4 pixels around each. `row` and `col`
    broadcast. Pixels at the edge repeat outward. The weights have the image's kind of float."""
    (rows, of_row), (cols, of_col) = _taps(row, image.shape[0], image.dtype), _taps(col, image.shape[1], image.dtype)
    return sum(of_row[i] * sum(of_col[j] * image[rows[i], cols[j]] for j in range(4)) for i in range(4))


def _taps(place: np.ndarray, count: int, precision: np.dtype) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The four pixels around each place, and their weights."""
    below = np.floor(place).astype(np.int32)
    f = (place - below).astype(precision)
    weights = [
        f * (-0.5 + f * (1 - 0.5 * f)),
        1 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    ]
    return [np.clip(below + k, 0, count - 1) for k in (-1, 0, 1, 2)], weights
