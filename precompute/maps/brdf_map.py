# SPDX-License-Identifier: GPL-3.0-or-later
"""BRDF maps: reflected colour over the hemisphere of views (thesis 6.1), as arrays, charts and OpenEXR files.

The pixel (x, y) = (sin t cos p, sin t sin p) shows the view at t from the normal and at the azimuth p.

The chart of a bake shows which colour goes where, for light from one angle. Its disc is a BRDF map. The strip below it
shows the views in the plane of the light, from the light's side to the other.

The OpenEXR files hold XYZ, or spectra with a channel for each wavelength. Channels of spectra are named as in A.
Fichet, R. Pacanowski and A. Wilkie, "An OpenEXR Layout for Spectral Images", JCGT 10(3), 2021: "T.550nm" is a
reflectance at 550 nm, "T.550,5nm" one at 550.5 nm."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..base.machine import bundled
from ..base.progress import Progress, silent
from ..colour.observer import WAVELENGTH_MIN_M, seen_wavelengths, spectral_weights, wavelengths
from ..colour.spaces import rgb_from_xyz, shown_rgb, srgb_encode
from ..methods.method import Method
from ..optics.brdf import fresnel_reflectance, half_angle_cosine, scattering_factor
from ..optics.mirror_image import mirror_kernel
from ..reference.reference import reference_grid
from ..spectra.series import Resampler, spectrum_series
from ..surface.relief import Relief
from ..table.radiance import reflected_xyz
from ..table.table import Table
from .pictures import FAINT, GROUND, INK, SIDE, Canvas

# Tolerance of the interpolation in s, finer than a picture can show. A test compares the result with the reference.
_EXACT = 1e-9
# Directions that are evaluated at once. For a bake they fit into a core's cache. A method's texels take tens of
# megabytes.
_PIXELS, _METHOD_PIXELS = 16384, 8192


class Seen(NamedTuple):
    """What a map holds of a spectrum: wavelengths (k,) in metres, and weights (k, channels) that sum the BRDF at each
    of them to the channels."""

    lambdas: np.ndarray
    weights: np.ndarray


def seen_colour(step_m: float, illuminant: str = "D65") -> Seen:
    """XYZ under an illuminant, from wavelengths step_m apart."""
    lambdas = seen_wavelengths(wavelengths(step_m), illuminant)
    return Seen(lambdas, spectral_weights(lambdas, illuminant))


def seen_spectrum(lambdas_m: np.ndarray) -> Seen:
    """The BRDF itself at wavelengths (k,) in metres, one channel for each."""
    return Seen(lambdas_m, np.eye(len(lambdas_m)))


def light_from(theta_i: float, phi_i: float = 0.0) -> np.ndarray:
    """The unit vector (3,) to a light at theta_i radians from the normal. It stands on the -x side, turned
    counterclockwise by phi_i radians, so that without a turn its mirror image is on the +x side.

    >>> [round(float(x), 3) for x in light_from(np.radians(30)) + 0.0]
    [-0.5, 0.0, 0.866]"""
    return np.array([-np.sin(theta_i) * np.cos(phi_i), -np.sin(theta_i) * np.sin(phi_i), np.cos(theta_i)])


def view_hemisphere(size: int, rows: slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
    """Views wr (rows, size, 3), and a mask (rows, size) of the pixels in the hemisphere. `rows` picks rows of a map of
    size x size pixels, counted along +y."""
    axis = (np.arange(size) + 0.5) * 2 / size - 1
    x, y = np.meshgrid(axis, axis[rows])
    radius2 = x**2 + y**2
    z = np.sqrt(np.maximum(1 - radius2, 0))
    return np.stack([x, y, z], axis=-1), radius2 < 1


def from_bake(bake: Table, size: int, wi: np.ndarray, *, stam: bool = False) -> np.ndarray:
    """Radiance XYZ (size, size, 3) under unit irradiance from wi (3,), axis 0 along +y, from a bake; NaN outside the
    hemisphere. The lamp is a disc with the kernel's variance, so that its mirror image covers some pixels.

    `stam` asks for Stam's form, else the materials' own (docs/theory.md, BRDF). The library's page calls it brdf_map:

    >>> brdf_map(read_bake(Path("bakes/blazed.exr"))[0], 64, light_from(np.radians(30))).shape
    (64, 64, 3)"""

    def xyz(view: np.ndarray) -> np.ndarray:
        return reflected_xyz(bake, wi, view, variance=bake.kernel_variance, stam=stam)

    return _hemisphere_of(xyz, size, channels=3, at_once=_PIXELS)


def from_reference(
    relief: Relief, sigma_b: float, size: int, *, wi: np.ndarray, seen: Seen, stam: bool = False,
    progress: Progress = silent,
) -> np.ndarray:  # fmt: skip
    """The map of from_bake for a dielectric, (size, size, channels), from the exact spectrum at the wavelengths of
    `seen`.

    It reads no table in (u, v), and every pixel has its own w. `progress` is called after each wavelength."""
    wr, inside = view_hemisphere(size)
    series = spectrum_series(relief, reference_grid(relief, sigma_b), 2 / WAVELENGTH_MIN_M, tolerance=_EXACT)
    axis = wr[0, :, 0]
    half = wi + wr
    w = half[..., 2]
    scattered = np.zeros((size, size, seen.weights.shape[1]))
    zero_order = np.zeros_like(scattered)
    for k, (lam, weight) in enumerate(zip(seen.lambdas, seen.weights, strict=True)):
        resample = Resampler(series.grid, axis + wi[0], axis + wi[1], lam, series.kernel_left(sigma_b, lam))
        mix = series.weights(w / lam) / lam**2
        density = sum(mix[..., m] * resample(series.scattered_over_s2[m][resample.kept]) for m in range(mix.shape[-1]))
        scattered += density[..., None] * weight
        zero_order += series.zero_order(w / lam)[..., None] * weight
        progress("reference", (k + 1) / len(seen.lambdas))
    kernel = mirror_kernel(wi, wr, variance=sigma_b**2)
    of_scattered, of_zero_order = _gains(wi, wr[inside], stam=stam)
    image = np.full(scattered.shape, np.nan)
    image[inside] = of_scattered[:, None] * scattered[inside]
    image[inside] += (of_zero_order * kernel[inside])[:, None] * zero_order[inside]
    return image


def from_method(
    method: Method, size: int, wi: np.ndarray, *, lambdas_m: np.ndarray | None = None, progress: Progress = silent
) -> np.ndarray:
    """The map of from_bake in Stam's form, from any method of precompute/methods; with lambdas_m (k,), the BRDF at
    these wavelengths in metres, (size, size, k).

    A method's density includes its zero order, which is therefore blurred by the kernel and multiplied by Stam's
    obliquity O instead of its own, 1. Close to the mirror direction the two agree. `progress` is called after each
    block of rows."""

    def seen(view: np.ndarray) -> np.ndarray:
        u, v, w = (wi + view).T
        if lambdas_m is None:
            density = method.xyz(u, v, w)
        else:
            density = np.stack([method.density(u, v, w, wavelength_m=lam) for lam in lambdas_m], axis=-1)
        of_scattered, _ = _gains(wi, view, stam=True)
        return (of_scattered / w**2)[:, None] * density

    channels = 3 if lambdas_m is None else len(lambdas_m)
    return _hemisphere_of(seen, size, channels=channels, at_once=_METHOD_PIXELS, told=partial(progress, method.name))


def _hemisphere_of(
    seen: Callable[[np.ndarray], np.ndarray],
    size: int,
    *,
    channels: int,
    at_once: int,
    told: Callable[[float], None] = lambda fraction: None,
) -> np.ndarray:
    """Evaluate seen(views (n, 3)), (n, channels), for all views above the surface, in rows of about `at_once`
    pixels."""
    image = np.full((size, size, channels), np.nan)
    rows_at_once = max(1, at_once // size)
    for start in range(0, size, rows_at_once):
        rows = slice(start, start + rows_at_once)
        wr, inside = view_hemisphere(size, rows)
        shown = np.flatnonzero(inside)
        image[rows].reshape(-1, channels)[shown] = seen(wr.reshape(-1, 3).take(shown, axis=0))
        told(min(start + rows_at_once, size) / size)
    return image


def _gains(wi: np.ndarray, view: np.ndarray, *, stam: bool) -> tuple[np.ndarray, np.ndarray]:
    """Factors (n,) that turn scattered XYZ over w^2, and the zero order's XYZ, into radiance under unit irradiance."""
    reflectance = fresnel_reflectance(half_angle_cosine(wi, view))
    return scattering_factor(wi, view, stam=stam), reflectance


def linear_rgb(xyz: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Convert XYZ (..., 3) to linear Rec.709. Pure colours have negative components."""
    return xyz @ rgb_from_xyz("Rec.709", illuminant).T


def picture(xyz: np.ndarray, illuminant: str = "D65", percentile: float = 99.5) -> np.ndarray:
    """8-bit sRGB (size, size, 3), row 0 at the top, white outside the hemisphere.

    It is exposed so that the given percentile of Y is 1. The specular peak, thousands of times brighter than the
    orders, clips."""
    return np.where(np.isnan(xyz), np.uint8(255), _coded(xyz / _level(xyz[..., 1], percentile), illuminant))[::-1]


# The disc's side and its upper left corner; the strip's upper edge, height and width; all in pixels.
_DISC, _LEFT, _TOP = 408, 52, 8
_STRIP_TOP, _STRIP_HIGH, _STRIP = 448, 24, 448
# Y of this percentile of the disc's views is shown as white. The mirror image clips.
_WHITE = 99.5
_RINGS_DEG = (30, 60)
_LAMP = (255, 210, 60)


def view_chart(table: Table, light_deg: float) -> np.ndarray:
    """The picture (SIDE, SIDE, 3) of 8 bits, row 0 on top, for light at an angle from the normal, from the left."""
    theta_i = np.radians(light_deg)
    wi = light_from(theta_i)
    xyz = from_bake(table, _DISC, wi)
    level = _level(xyz[..., 1])
    canvas = Canvas()
    disc = _coded(xyz / level, table.illuminant)
    disc[~np.isfinite(xyz[..., 1])] = GROUND
    canvas.paste(disc[::-1], _LEFT, _TOP)
    _draw_rings(canvas, theta_i)
    angles = np.radians((np.arange(_STRIP) + 0.5) * 180 / _STRIP - 90)
    views = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
    xyz = reflected_xyz(table, wi, views, variance=table.kernel_variance)
    strip = _coded(xyz / level, table.illuminant)
    canvas.paste(np.tile(strip, (_STRIP_HIGH, 1, 1)), (SIDE - _STRIP) // 2, _STRIP_TOP)
    _draw_degrees(canvas)
    canvas.text(f"light {light_deg:g} deg", 8, 14, anchor="lm", colour=_LAMP)
    return canvas.pixels()


def _level(luminance: np.ndarray, percentile: float = _WHITE) -> float:
    """The luminance that is shown as white."""
    known = luminance[np.isfinite(luminance)]
    level = float(np.percentile(known, percentile))
    return level if level > 0 else max(float(known.max()), 1e-30)


def _coded(xyz: np.ndarray, illuminant: str) -> np.ndarray:
    rgb = shown_rgb(np.nan_to_num(xyz), rgb_from_xyz("Rec.709", illuminant))
    return np.rint(srgb_encode(rgb) * 255).astype(np.uint8)


def _draw_rings(canvas: Canvas, theta_i: float) -> None:
    radius = _DISC / 2
    x, y = _LEFT + radius, _TOP + radius
    canvas.circle(x, y, radius, colour=FAINT)
    for degrees in _RINGS_DEG:
        ring = radius * np.sin(np.radians(degrees))
        canvas.circle(x, y, ring, colour=FAINT)
        canvas.text(f"{degrees}", x, y - ring, anchor="mm")
    lamp = radius * np.sin(theta_i)
    canvas.circle(x - lamp, y, 4, colour=_LAMP, filled=True)
    canvas.text("mirror", x + lamp, y + 14, anchor="mm")
    canvas.circle(x + lamp, y, 4, colour=INK)


def _draw_degrees(canvas: Canvas) -> None:
    left = (SIDE - _STRIP) / 2
    for degrees in range(-90, 91, 30):
        x, y = left + (degrees + 90) / 180 * _STRIP, _STRIP_TOP + _STRIP_HIGH
        canvas.line(x, y, to=(x, y + 4))
        canvas.text(f"{degrees}", x, y + 12, anchor="mm")
    canvas.text("angle of view in the plane of the light, in degrees", SIDE / 2, SIDE - 8, anchor="mm")


def write_xyz(path: Path, xyz: np.ndarray) -> None:
    """Write XYZ (rows, cols, 3), row 0 at the bottom. Raises as write_spectra does."""
    _write(path, {name: xyz[..., k] for k, name in enumerate("XYZ")}, {})


def write_spectra(path: Path, image: np.ndarray, lambdas_m: np.ndarray) -> None:
    """Write spectra (rows, cols, k), row 0 at the bottom, at wavelengths (k,) in metres.

    Raises OSError if they cannot be written, GratingError if OpenEXR cannot be loaded."""
    channels = {channel_name(lam): image[..., k] for k, lam in enumerate(lambdas_m)}
    _write(path, channels, {"spectralLayoutVersion": "1.0"})


def channel_name(lambda_m: float) -> str:
    """The name of a wavelength's channel, to a hundredth of a nanometre."""
    nanometres = f"{round(lambda_m * 1e9, 2):g}".replace(".", ",")
    return f"T.{nanometres}nm"


def _write(path: Path, channels: Mapping[str, np.ndarray], attributes: Mapping[str, str]) -> None:
    """Write named channels (rows, cols), with 0 where there is no number."""
    OpenEXR = bundled("OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    upright = {name: np.ascontiguousarray(np.nan_to_num(each)[::-1], np.float32) for name, each in channels.items()}
    # Given a path, OpenEXR fails outside UTF-8 and hides the system's error messages.
    with OpenEXR.File(header, upright) as picture, path.open("wb") as file:
        picture.write(file)
