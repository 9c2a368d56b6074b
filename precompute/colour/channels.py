# SPDX-License-Identifier: GPL-3.0-or-later
"""The channels of a bake for lamps of several spectra, and the matrix from them to a lamp's colours.

A bake's channels are integrals of the reflected spectrum R(wavelength) times fixed curves. The first three are XYZ
under the first illuminant. With more channels, each lamp's XYZ is a matrix (3, channels) times the channels:

    smooth   three curves, for black bodies and daylight
    led      six curves, also for LEDs
    FL11     three curves: the colour matching functions times the spectrum of FL11, which its matrix takes alone

The curves of the sets are those that miss the least of a list of lamps, beside the first three channels and for
reflectances whose values are correlated over CORRELATION_NM (devtools/tables/generate_channel_table.py). They are the
greatest singular vectors of the lamps' curves, in Rec.709 and weighted by this correlation. A lamp's matrix is the
least squares of its curves under the same correlation. It holds a constant spectrum exactly.

A material takes a lamp's matrix from a table, by one number, the lamp's row:

    0                       white: D65
    BLACK_BODY              black bodies, at equal steps of a mired, 1e6 / kelvins
    DAYLIGHT                daylight, likewise
    then                    the CIE's illuminants, and lines at each nanometre
    last                    further lamps, such as files' spectra, in a given order

A row holds a column for each channel, the linear RGB of the channel over that of the scene's lamp, and a last column:
the share of each of these components in the luminance."""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from .illuminants import (
    BLACK_BODY_K,
    CHANNEL_SETS,
    FIRST,
    ILLUMINANTS,
    JOINT,
    LINES_NM,
    OWN_MAX,
    canonical,
    line_of,
    named,
    parts_of,
    spectrum,
)
from .observer import integration_rule, interpolated_weights, mirror_xyz, observer, spectral_weights, wavelengths
from .spaces import lamp_rgb, rgb_from_xyz, rgb_over_lamp

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
    (spaces.lamp_rgb). The first illuminant counts as a white lamp."""
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


_STEP_MIRED = 1.0


def _temperatures(lowest: int, highest: int) -> list[int]:
    """Kelvins, highest first, at equal steps of a mired."""
    return [round(1e6 / mired) for mired in np.arange(1e6 / highest, 1e6 / lowest + 0.5, _STEP_MIRED)]


_BLACK_BODIES = [f"{kelvins}K" for kelvins in _temperatures(*BLACK_BODY_K)]
# Daylight begins at 4000 K.
_DAYLIGHTS = [f"D{kelvins}" for kelvins in _temperatures(4000, BLACK_BODY_K[1])]
BLACK_BODY, DAYLIGHT = 1, 1 + len(_BLACK_BODIES)
_OTHERS = [*(name for name in named() if name != FIRST), *(f"{nm}nm" for nm in range(LINES_NM[0], LINES_NM[1] + 1))]
# The distance in the CIE 1976 diagram (u', v') up to which a light's colour counts as a black body's or daylight's.
_NEAR = 0.02


def lamps_of_table(further: Sequence[str] = ()) -> list[str]:
    """The lamps of all rows, in order."""
    return [FIRST, *_BLACK_BODIES, *_DAYLIGHTS, *_OTHERS, *further]


@cache
def _rows() -> dict[str, int]:
    """The row of each lamp that every table holds."""
    return {lamp: row for row, lamp in reversed(list(enumerate(lamps_of_table())))}


def row_of(lamp: str, further: Sequence[str] = ()) -> float:
    """The row of a lamp. Raises ValueError for a lamp that is neither in every table nor among the further ones."""
    for letter, first in (("K", BLACK_BODY), ("D", DAYLIGHT)):
        kelvins = lamp.replace(letter, "", 1)
        if letter in lamp and kelvins.isdigit() and len(kelvins) > 3:
            return first + round((1e6 / int(kelvins) - 1e6 / BLACK_BODY_K[1]) / _STEP_MIRED)
    rows = _rows()
    return rows[lamp] if lamp in rows else len(rows) + list(further).index(lamp)


def row_of_temperature(kelvins: str) -> str:
    """An expression for a driver: the row of a black body of `kelvins`, an expression too."""
    first = 1e6 / BLACK_BODY_K[1]
    mired = f"min(max(1e6 / {kelvins}, {first:g}), {1e6 / BLACK_BODY_K[0]:g})"
    return f"{BLACK_BODY} + ({mired} - {first:g}) / {_STEP_MIRED:g}"


def lamp_table(space: str, illuminant: str, further: Sequence[str] = ()) -> np.ndarray:
    """The table (rows, channels + 1, 3) float32 of a bake under an illuminant, for a linear space."""
    lamps = lamps_of_table(further)
    luminance = np.linalg.inv(rgb_from_xyz(space))[1]
    table = np.zeros((len(lamps), channel_count(illuminant) + 1, 3), np.float32)
    for row, lamp in enumerate(lamps):
        table[row, :-1] = scene_matrix(space, illuminant, lamp).T
        table[row, -1] = luminance * (1.0 if lamp == FIRST else lamp_rgb(space, lamp))
    return table


@cache
def _places(space: str) -> tuple[np.ndarray, np.ndarray]:
    """The rows (n,) of black bodies and daylight, and their u', v' (n, 2) as lamps of a space."""
    rows = np.arange(BLACK_BODY, DAYLIGHT + len(_DAYLIGHTS))
    to_xyz = np.linalg.inv(rgb_from_xyz(space))
    lamps = lamps_of_table()
    return rows, _uv(np.array([to_xyz @ lamp_rgb(space, lamps[row]) for row in rows]))


def _uv(xyz: np.ndarray) -> np.ndarray:
    """u', v' (n, 2) of the CIE 1976 diagram."""
    x, y, z = xyz.T
    return np.stack([4 * x, 9 * y], axis=-1) / np.maximum(x + 15 * y + 3 * z, 1e-12)[:, None]


def nearest_row(rgb: Sequence[float], space: str) -> float:
    """The row of the black body or daylight whose colour is the nearest to a light's linear RGB; 0 for a light of
    another colour, which counts as white behind a filter."""
    xyz = np.linalg.inv(rgb_from_xyz(space)) @ np.asarray(rgb, float)
    if xyz[1] <= 0:
        return 0.0
    rows, places = _places(space)
    distances = np.hypot(*(places - _uv(xyz[None])).T)
    white = np.hypot(*(_uv(mirror_xyz(FIRST)[None]) - _uv(xyz[None]))[0])
    nearest = int(distances.argmin())
    return float(rows[nearest]) if distances[nearest] < min(_NEAR, white) else 0.0


# Spectra as smooth as a black body's or daylight's.
_SMOOTH = re.compile("A|C|D[0-9]+|[0-9]+K")
_BLACK_BODY, _DAYLIGHT = re.compile("([0-9]+)K"), re.compile("D([0-9]{4,})")


def light_for(lamps: Iterable[str]) -> str:
    """The canonical text of the light under which a bake serves lamps (canonical texts): a set of channels for black
    bodies, daylight and LEDs, and own colours for tubes, lines and files.

    Raises GratingError if more lamps need colours of their own than a bake can have."""
    others = sorted({lamp for lamp in lamps if lamp != FIRST})
    own = [lamp for lamp in others if not (_SMOOTH.fullmatch(lamp) or lamp.startswith("LED-"))]
    if len(own) > OWN_MAX:
        told = ", ".join(f"{lamp:.20}" for lamp in own)
        raise GratingError(told, f"a bake has colours of their own for {OWN_MAX} lamps", "use fewer kinds of lamps")
    sets = ["led"] if any(lamp.startswith("LED-") for lamp in others) else ["smooth"] if len(others) > len(own) else []
    return canonical(JOINT.join([FIRST, *sets, *own])) if others else FIRST


def stated_error(lamp: str, light: str, stated: Mapping[str, tuple[float, float]]) -> tuple[float, float] | None:
    """The mean and the 95th percentile of dE00 under a lamp of a bake under a light, from those that its header states
    by lamp; None if nothing is stated. A lamp takes the error of one of its kind; a black body's is interpolated."""
    if not stated or lamp in parts_of(light):
        return None
    if lamp in stated:
        return stated[lamp]
    if kelvins := _BLACK_BODY.fullmatch(lamp):
        return _interpolated(1e6 / int(kelvins[1]), stated)
    if _SMOOTH.fullmatch(lamp):
        found = _DAYLIGHT.fullmatch(lamp)
        near = "D5500" if found is None or int(found[1]) < 7000 else "10000K"
        return stated.get(near)
    bands = {name: pair for name, pair in stated.items() if not _SMOOTH.fullmatch(name)}
    alike = [pair for name, pair in bands.items() if name.startswith("LED-") == lamp.startswith("LED-")]
    return max(alike, key=lambda pair: pair[1], default=None)


def _interpolated(mired: float, stated: Mapping[str, tuple[float, float]]) -> tuple[float, float] | None:
    """The error of a black body between the two stated ones around it, linear in mireds."""
    found = [(1e6 / int(match[1]), pair) for name, pair in stated.items() if (match := _BLACK_BODY.fullmatch(name))]
    below = max((each for each in found if each[0] <= mired), default=min(found, default=None))
    above = min((each for each in found if each[0] >= mired), default=max(found, default=None))
    if below is None or above is None:
        return None
    (low, first), (high, second) = below, above
    share = (mired - low) / (high - low) if high > low else 0.0
    share = min(max(share, 0.0), 1.0)
    return first[0] + share * (second[0] - first[0]), first[1] + share * (second[1] - first[1])
