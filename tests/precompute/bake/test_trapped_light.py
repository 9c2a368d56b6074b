# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that a plate traps: the gains of a bake against closed forms, and against the matrix T S (1 - r S)^-1 T."""

import numpy as np
import pytest

from precompute.bake.ensemble import plan
from precompute.bake.request import BakeRequest
from precompute.bake.trapped_light import plate_gains
from precompute.colour.observer import spectral_weights
from precompute.optics.brdf import fresnel_reflectance, half_angle_cosine, small_slope_reflectance
from precompute.optics.plate import face_reflectance
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import flat
from precompute.table.plate_gains import PlateGains

IOR = 1.585
LAMBDAS = np.arange(400, 701, 20) * 1e-9
PITCH_M, DEPTH_M, PARTS, RIDGE = 740e-9, 105e-9, 37, 16


def groove() -> HeightMap:
    """A continuous groove of a DVD: pitch 740 nm, width 320 nm, depth 105 nm."""
    heights = DEPTH_M * (np.arange(PARTS) < RIDGE)
    pixel = PITCH_M / PARTS
    return HeightMap(np.tile(heights, (8, 16)), (pixel, pixel), "groove", periodic=True)


def gains_of(height_map: HeightMap, matter: str) -> PlateGains:
    asked = parse(f"plate {IOR}, {matter}")
    chosen = plan(prepare(height_map, plate_ior=IOR), BakeRequest(coherence_length_m=16e-6, matter=asked))
    return plate_gains(chosen.ensemble, chosen.sigma_b, matter=asked, illuminant="D65")


def direction(theta_deg: float, azimuth_deg: float) -> np.ndarray:
    theta, azimuth = np.radians([theta_deg, azimuth_deg])
    return np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])


def unit(tangential: np.ndarray) -> np.ndarray:
    return np.concatenate([tangential, np.sqrt(1 - np.sum(tangential**2, axis=-1, keepdims=True))], axis=-1)


def efficiencies(k: np.ndarray, order: np.ndarray, matter: str, wavelength_m: float) -> np.ndarray:
    """S (m, m) between the orders of the groove that travel inside at k (m, 2)."""
    wi, wr = np.broadcast_arrays(unit(-k), unit(k)[:, None])
    w, half = wi[..., 2] + wr[..., 2], half_angle_cosine(wi, wr)
    phase, duty, step = 2 * np.pi * w * IOR * DEPTH_M / wavelength_m, RIDGE / PARTS, order[:, None] - order
    zero = np.abs(duty * np.exp(-1j * phase) + 1 - duty) ** 2
    scattered = duty**2 * np.sinc(step * duty) ** 2 * np.abs(np.exp(-1j * phase) - 1) ** 2
    under = parse(f"plate {IOR}, {matter}")
    reflectance = under.reflectance(np.array([wavelength_m]), half.ravel()).reshape(w.shape)
    factor = 4 * wi[..., 2] * wr[..., 2] * small_slope_reflectance(wi, wr, under.ratio_ior) / w**2
    return reflectance * factor / fresnel_reflectance(half, under.ratio_ior) * np.where(step == 0, zero, scattered)


def found_and_true(gains: PlateGains, matter: str, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The luminance (2,) of the mirror image and of the orders of light from wi: by the gains, and by the matrix."""
    found, true = np.zeros((2, 2))
    luminance = spectral_weights(LAMBDAS)[:, 1]
    for wavelength_m, y in zip(LAMBDAS, luminance / luminance.sum(), strict=True):
        order = np.arange(-9, 10)
        k = -wi[:2] / IOR + np.outer(order * wavelength_m / (PITCH_M * IOR), [1, 0])
        order, k = (each[np.sum(k**2, axis=1) < 1 - 1e-6] for each in (order, k))
        own, face = order == 0, face_reflectance(k, IOR)
        s = efficiencies(k, order, matter, wavelength_m)
        once = s / np.maximum(s.sum(axis=0), 1)  # no light is sent out more than once
        inner = np.linalg.solve(np.eye(len(k)) - face[:, None] * once, own * (1 - face[own]))
        out, single = (1 - face) * (once @ inner), s[:, own][:, 0]
        leaves = np.sum((k * IOR) ** 2, axis=1) < 1
        others = leaves & ~own
        true += y * np.array([out[own].sum(), out[others].sum()])
        gain = gains.of_scattered(wi, unit(k[others] * IOR))
        found += y * np.array([(single * (1 - face) ** 2)[own].sum(), gain @ single[others]])
    return found + [gains.mirror_xyz(wi * [-1, -1, 1])[1], 0], true


@pytest.fixture(scope="module")
def dvd() -> PlateGains:
    return gains_of(groove(), "aluminium")


@pytest.fixture(scope="module")
def mirror() -> PlateGains:
    return gains_of(groove(), "mirror")


@pytest.mark.short("[20.0-45.0", "[60.0-90.0")
@pytest.mark.parametrize("azimuth_deg", [0.0, 45.0, 90.0])
@pytest.mark.parametrize("theta_deg", [0.0, 20.0, 30.0, 45.0, 60.0])
def test_a_dvd_sends_out_what_the_matrix_says(dvd, theta_deg, azimuth_deg):
    """All light and the orders alone are within 5 %. The matrix alone has 1.08 to 1.35 times the orders of a single
    pass, and up to 8 times its mirror image. Along the grooves, from 45 degrees on, few orders leave or none."""
    found, true = found_and_true(dvd, "aluminium", direction(theta_deg, azimuth_deg))
    assert found.sum() == pytest.approx(true.sum(), rel=0.05)
    few = azimuth_deg == 90 and theta_deg >= 45
    assert found[1] == pytest.approx(true[1], abs=0.05 * (true.sum() if few else true[1]))


@pytest.mark.night("tests/precompute/cli/test_bake_preset.py")
def test_a_flat_mirror_is_exact():
    """T^2 / (1 - r) = T for a perfect mirror, so the mirror image has T - T^2 more than a single pass. Reading between
    texels has an error of the fourth order of their distance: 1e-3 of the light."""
    gains = gains_of(flat(), "mirror")
    ways = np.array([direction(theta, 20.0) for theta in (0.0, 30.0, 60.0, 80.0)])
    face = fresnel_reflectance(ways[:, 2], IOR)
    assert gains.mirror_xyz(ways)[:, 1] == pytest.approx((1 - face) * face, abs=1e-3)
    assert gains.of_scattered(ways, ways) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("theta_deg", [0.0, 30.0, 60.0, 75.0])
def test_a_perfect_mirror_returns_no_more_than_arrives(mirror, theta_deg):
    """A perfect relief keeps no light, so all of it leaves, T off the front face: at most 1. The form's S returns up to
    1.13 of the light at single directions; what it returns in sum of this relief is within 5 % of T."""
    wi = direction(theta_deg, 30.0)
    found, _ = found_and_true(mirror, "mirror", wi)
    assert found.sum() <= 1.0
