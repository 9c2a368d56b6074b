# SPDX-License-Identifier: GPL-3.0-or-later
"""The channels of a bake for lamps of several spectra, and the matrix from them to a lamp's colours.

A bake's channels are integrals of the reflected spectrum R(wavelength) times fixed curves. The first three are XYZ
under the first illuminant. With more channels, each lamp's XYZ is a matrix (3, channels) times the channels:

    smooth   three curves, for black bodies and daylight
    led      six curves, also for LEDs
    FL11     three curves: the colour matching functions times the spectrum of FL11, which its matrix takes alone

The curves of the sets are those that miss the least of a list of lamps, beside the first three channels and for
reflectances whose values are correlated over CORRELATION_NM (devtools/generate_channel_table.py). They are the greatest
singular vectors of the lamps' curves, in Rec.709 and weighted by this correlation. A lamp's matrix is the least squares
of its curves under the same correlation. It holds a constant spectrum exactly."""

from functools import cache
from pathlib import Path

import numpy as np

from .illuminants import CHANNEL_SETS, ILLUMINANTS, line_of, parts_of, spectrum
from .observer import integration_rule, interpolated_weights, mirror_xyz, observer, spectral_weights, wavelengths
from .working_space import lamp_rgb, rgb_from_xyz, rgb_over_lamp

# How far apart the wavelengths are, in nanometres, over which a reflectance is correlated, as a standard deviation; and
# the share of its variance that is not correlated at all.
CORRELATION_NM, _UNCORRELATED = 20.0, 1e-3
# The weight of the constant spectrum in the least squares, so that it is exact to a millionth.
_CONSTANT = 1e3


def channel_count(illuminant: str) -> int:
    """The number of channels of a bake under an illuminant: three, or more for several parts."""
    return sum(CHANNEL_SETS.get(part, 3) for part in parts_of(illuminant))


def channel_weights(wavelengths_m: np.ndarray, illuminant: str) -> np.ndarray:
    """Weights (n, channels) whose products with a spectrum at wavelengths (n,), summed over n, are its channels.

    The wavelengths are those of seen_wavelengths, and the first three weights those of spectral_weights."""
    first, *others = parts_of(illuminant)
    nm = np.asarray(wavelengths_m) * 1e9
    return np.hstack([spectral_weights(wavelengths_m, first), *(_weights_of_part(nm, part) for part in others)])


def _weights_of_part(nm: np.ndarray, part: str) -> np.ndarray:
    if part in CHANNEL_SETS:
        table = _table()
        at, widths = integration_rule(np.concatenate([table[:, 0], nm]))
        return interpolated_weights(nm, at, _set_curves(part, at) * widths[:, None])
    if line := line_of(part):
        return interpolated_weights(nm, np.array([line * 1e9]), mirror_xyz(part)[None])
    return spectral_weights(nm * 1e-9, part)


@cache
def _table() -> np.ndarray:
    """The wavelengths in nanometres, and the curves of the sets (81, 10), linear between two wavelengths."""
    return np.loadtxt(Path(__file__).with_name("channels_5nm.csv"), delimiter=",")


def _set_curves(name: str, nm: np.ndarray) -> np.ndarray:
    """The curves (n, count) of a set at wavelengths (n,) in nanometres."""
    first = 1 + sum(CHANNEL_SETS[each] for each in list(CHANNEL_SETS)[: list(CHANNEL_SETS).index(name)])
    columns = _table()[:, first : first + CHANNEL_SETS[name]].T
    return np.stack([np.interp(nm, _table()[:, 0], column) for column in columns], axis=-1)


def lamp_matrix(illuminant: str, lamp: str) -> np.ndarray:
    """The matrix (3, channels) from a bake's channels under an illuminant to XYZ under a lamp.

    It is exact for the parts of the illuminant. Three channels are all that a plain bake has: its colours are then
    multiplied by the lamp's colour in Rec.709, as a renderer does."""
    parts = parts_of(illuminant)
    if lamp in parts:
        before = sum(map(channel_count, parts[: parts.index(lamp)]))
        return np.eye(3, channel_count(illuminant), before)
    if len(parts) == 1:
        return np.linalg.solve(rgb_from_xyz(), lamp_rgb("Rec.709", lamp)[:, None] * rgb_from_xyz("Rec.709", illuminant))
    least_squares, of_constant = _least_squares(illuminant)
    return (least_squares @ lamp_curves(lamp) + of_constant[:, None] * mirror_xyz(lamp)).T


def scene_matrix(space: str, illuminant: str, lamp: str) -> np.ndarray:
    """The matrix (3, channels) from a bake's channels to linear RGB of a space, over that of the scene's lamp
    (working_space.lamp_rgb). The first illuminant counts as a white lamp."""
    if lamp == parts_of(illuminant)[0]:
        return rgb_from_xyz(space, lamp) @ lamp_matrix(illuminant, lamp)
    return rgb_over_lamp(space, lamp) @ lamp_matrix(illuminant, lamp)


@cache
def _least_squares(illuminant: str) -> tuple[np.ndarray, np.ndarray]:
    """The matrix (channels, 401) from a lamp's curves to its matrix' columns, and the vector (channels,) from its
    mirror's colour."""
    nm = wavelengths(1e-9)
    weights = channel_weights(nm, illuminant)
    curves = np.vstack([correlation_root() @ weights, _CONSTANT * weights.sum(axis=0)])
    scale = np.abs(curves).max(axis=0)
    inverse = np.linalg.pinv(curves / scale, rcond=1e-9) / scale[:, None]
    return inverse[:, :-1] @ correlation_root(), _CONSTANT * inverse[:, -1]


@cache
def correlation_root() -> np.ndarray:
    """A matrix (401, 401) whose product with a curve at each nanometre has the square |.|^2 that the curve's product
    with a random reflectance has in the mean."""
    nm = wavelengths(1e-9) * 1e9
    correlated = np.exp(-0.5 * ((nm[:, None] - nm) / CORRELATION_NM) ** 2)
    return np.linalg.cholesky(correlated + _UNCORRELATED * np.eye(len(nm))).T


def lamp_curves(lamp: str) -> np.ndarray:
    """The weights (401, 3) of XYZ under a lamp, at each nanometre from 380 to 780."""
    nm = wavelengths(1e-9)
    if lamp in ILLUMINANTS or line_of(lamp):
        return spectral_weights(nm, lamp) if lamp in ILLUMINANTS else _weights_of_part(nm * 1e9, lamp)
    products = observer(nm, "E") * np.interp(nm * 1e9, *spectrum(lamp), left=0, right=0)[:, None]
    return products * (mirror_xyz(lamp)[1] / products[:, 1].sum())
