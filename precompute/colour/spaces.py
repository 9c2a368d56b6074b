# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts XYZ to the linear RGB of a renderer, to sRGB code values and to L*a*b*, and measures colour differences.

A spectrum's colour is purer than the primaries of an RGB space, so some components are negative, which renderers cannot
use. To set them to 0 adds light: a CD would reflect 6 % too much in Rec.709. A colour is instead moved towards the grey
of the same luminance, until no component is negative. So all light is kept, whatever the number of lamps.

addon/materials/atlas_nodes.py does the same with nodes, addon/materials/osl/gamut.osl in a shader."""

import numpy as np

from ..optics.brdf import fresnel_reflectance
from ..reflectance.matter import Matter
from .illuminants import ILLUMINANTS, first_of
from .observer import is_white, mirror_xyz, seen_wavelengths, spectral_weights, wavelengths, white_xyz

# The xy chromaticities of each space's primaries and white, from ITU-R BT.709, BT.2020 and SMPTE ST 2065 (AP1).
_D65_XY = (0.3127, 0.3290)
_ACES_XY = (0.32168, 0.33767)
RGB_SPACES = {
    "Rec.709": (((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), _D65_XY),
    "Rec.2020": (((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), _D65_XY),
    "ACEScg": (((0.713, 0.293), (0.165, 0.830), (0.128, 0.044)), _ACES_XY),
}
# The least component of a lamp's colour, by which colours are divided.
_LEAST = 0.02
# Of the wavelengths of a smooth surface's colour: fringes of a layer of 10 um are 10 nm apart at 450 nm.
_STEP_M = 2e-9
# The least cosine there. At 0 the front face of a plate reflects all light, and its formula divides 0 by 0.
_COSINE_MIN = 1e-6
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def _xyz_of_xy(xy: tuple[float, float]) -> np.ndarray:
    x, y = xy
    return np.array([x / y, 1.0, (1 - x - y) / y])


def rgb_from_xyz(space: str = "Rec.709", illuminant: str = "D65") -> np.ndarray:
    """The matrix (3, 3) from XYZ under an illuminant to linear RGB of a space in RGB_SPACES.

    A perfect mirror becomes (1, 1, 1), except under light that nobody sees as white (observer.is_white). E is adapted
    by the Bradford transform (Lindbloom). Under another lamp each component is divided by the lamp's own (lamp_rgb).
    So a scene's lamp of that colour shows the colours that the lamp has beside daylight, where an adaptation would
    shift them by a dE00 of 5 under 2700 K."""
    illuminant = first_of(illuminant)
    if illuminant in ILLUMINANTS or not is_white(illuminant):
        return adapted_matrix(space, white_xyz(illuminant))
    return rgb_over_lamp(space, illuminant)


def rgb_over_lamp(space: str, illuminant: str) -> np.ndarray:
    """The matrix (3, 3) from XYZ under a lamp to linear RGB over that of the scene's lamp (lamp_rgb)."""
    kept = _kept(space, illuminant)
    in_space = kept * adapted_matrix(space, white_xyz())
    in_space[:, 1] += 1 - kept
    return in_space / lamp_rgb(space, illuminant)[:, None]


def lamp_rgb(space: str, illuminant: str) -> np.ndarray:
    """The linear RGB (3,), with a luminance of 1, of a scene's lamp.

    A lamp beside the space's edge, such as a candle in Rec.709, is moved towards the grey of its luminance until its
    least component is _LEAST."""
    rgb = adapted_matrix(space, white_xyz()) @ mirror_xyz(illuminant)
    return 1 + _kept(space, illuminant) * (rgb - 1)


def lamp_line(space: str, illuminant: str) -> str:
    """A line with the colour of a scene's lamp for an illuminant; "" if the lamp is white."""
    if first_of(illuminant) in ILLUMINANTS or not is_white(illuminant):
        return ""
    return f"lamp colour {', '.join(f'{each:.3f}' for each in lamp_rgb(space, illuminant))} ({space})"


def _kept(space: str, illuminant: str) -> float:
    """The share of its colour that a lamp keeps in a space."""
    least = (adapted_matrix(space, white_xyz()) @ mirror_xyz(illuminant)).min()
    return min(1.0, (1 - _LEAST) / (1 - least)) if least < 1 else 1.0


def adapted_matrix(space: str, white: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) from XYZ to linear RGB of a space by which a white (3,) becomes (1, 1, 1), by Bradford's
    transform."""
    primaries_xy, white_xy = RGB_SPACES[space]
    space_white = _xyz_of_xy(white_xy)
    primaries = np.stack([_xyz_of_xy(xy) for xy in primaries_xy], axis=1)
    to_xyz = primaries * np.linalg.solve(primaries, space_white)
    cones = (_BRADFORD @ space_white) / (_BRADFORD @ white)
    adapt = np.linalg.solve(_BRADFORD, cones[:, None] * _BRADFORD)
    return np.linalg.solve(to_xyz, adapt)


def srgb_encode(linear: np.ndarray) -> np.ndarray:
    """Encode linear Rec.709 (...,) as sRGB code values (...,) from 0 to 1, clipped to that range (IEC 61966-2-1)."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def shown_rgb(xyz: np.ndarray, rgb_from_xyz: np.ndarray) -> np.ndarray:
    """Linear RGB (..., 3), without negative components, of colours in XYZ (..., 3), for a matrix (3, 3) of
    rgb_from_xyz.

    A colour with negative components becomes Y + Y / (Y - m) (rgb - Y), where m is the least of them. Its luminance
    stays Y. A colour without luminance becomes black."""
    rgb = xyz @ rgb_from_xyz.T
    y = np.maximum(xyz[..., 1:2], 0)
    lowest = np.minimum(rgb.min(axis=-1, keepdims=True), 0)
    share = np.divide(y, y - lowest, out=np.zeros_like(y), where=y > 0)
    # Rounding leaves a component of -1e-17 where the least one is 0.
    return np.maximum(y + share * (rgb - y), 0)


def lab(xyz: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Convert XYZ (..., 3) to CIE 1976 L*a*b* (..., 3), relative to a white's XYZ (3,)."""
    t = xyz / white
    eps, kappa = 216 / 24389, 24389 / 27
    f = np.where(t > eps, np.cbrt(t), (kappa * t + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def delta_e_2000(lab_1: np.ndarray, lab_2: np.ndarray) -> np.ndarray:
    """CIEDE2000 differences (...,) of L*a*b* colours (..., 3) (Sharma, Wu and Dalal 2005, equations 2 to 22)."""
    l1, a1, b1 = np.moveaxis(np.asarray(lab_1, float), -1, 0)
    l2, a2, b2 = np.moveaxis(np.asarray(lab_2, float), -1, 0)
    c_mean7 = (0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2))) ** 7
    g = 1.5 - 0.5 * np.sqrt(c_mean7 / (c_mean7 + 25.0**7))
    c1, c2 = np.hypot(a1 * g, b1), np.hypot(a2 * g, b2)
    h1, h2 = np.arctan2(b1, a1 * g) % (2 * np.pi), np.arctan2(b2, a2 * g) % (2 * np.pi)
    grey = c1 * c2 == 0
    turn = np.where(grey, 0, (h2 - h1 + np.pi) % (2 * np.pi) - np.pi)
    dl, dc, dh = l2 - l1, c2 - c1, 2 * np.sqrt(c1 * c2) * np.sin(turn / 2)
    l_mean, c_mean = 0.5 * (l1 + l2), 0.5 * (c1 + c2)
    h_mean = np.where(grey, h1 + h2, h1 + turn / 2)
    t = (
        1
        - 0.17 * np.cos(h_mean - np.radians(30))
        + 0.24 * np.cos(2 * h_mean)
        + 0.32 * np.cos(3 * h_mean + np.radians(6))
        - 0.20 * np.cos(4 * h_mean - np.radians(63))
    )
    bell = np.exp(-((((np.degrees(h_mean) % 360) - 275) / 25) ** 2))
    rotation = -2 * np.sqrt(c_mean**7 / (c_mean**7 + 25.0**7)) * np.sin(np.radians(60) * bell)
    dl /= 1 + 0.015 * (l_mean - 50) ** 2 / np.sqrt(20 + (l_mean - 50) ** 2)
    dc /= 1 + 0.045 * c_mean
    dh /= 1 + 0.015 * c_mean * t
    return np.sqrt(np.maximum(dl**2 + dc**2 + dh**2 + rotation * dc * dh, 0))


def smooth_colour(
    matter: Matter, cosines: np.ndarray, *, space: str = "Rec.709", illuminant: str = "D65"
) -> np.ndarray:
    """Linear RGB of a space, then the luminance, of what a smooth surface reflects, (m, 4). A perfect mirror has the
    luminance 1.

    The cosines (m,) are of the angle of incidence in air. R = `matter.reflectance` and the reflectance r of a plate's
    front face add up incoherently, with all reflections between both: r + (1 - r)^2 R / (1 - r R)."""
    cosines = np.maximum(cosines, _COSINE_MIN)
    lambdas = seen_wavelengths(wavelengths(_STEP_M), illuminant)
    n = matter.plate_ior
    inside = matter.reflectance(lambdas, np.sqrt(1 - (1 - cosines**2) / n**2))
    face = fresnel_reflectance(cosines, n)
    xyz = (face + (1 - face) ** 2 * inside / (1 - face * inside)).T @ spectral_weights(lambdas, illuminant)
    return np.column_stack([shown_rgb(xyz, rgb_from_xyz(space, illuminant)), xyz[:, 1]])
