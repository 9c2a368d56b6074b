# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import delta_e_2000, lab, rgb_from_xyz, shown_rgb, srgb_encode
from precompute.maps.brdf_map import (
    from_bake,
    from_method,
    from_reference,
    light_from,
    linear_rgb,
    picture,
    seen_colour,
    seen_spectrum,
    view_hemisphere,
)
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.optics.brdf import fresnel_reflectance, small_slope_reflectance
from precompute.optics.mirror_image import mirror_kernel
from precompute.reference.reference import reference_xyz
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.radiance import lamp_radiance
from precompute.table.table import Table

SIGMA_B, COHERENCE_M, STEP_M = 0.061897, 4e-6, 20e-9
THETA = np.radians(35)


def skin(size=48, pixel=85e-9, *, quarters=0):
    """A grating of 1.02 um along T with asymmetric facets, slightly irregular along B too; as numpy turns it by
    quarters."""
    x, y = np.meshgrid(*[np.arange(size) / size] * 2)
    phase = 2 * np.pi * 4 * x + 0.5 * np.cos(2 * np.pi * (x + 2 * y))
    heights = 70e-9 * np.sin(phase) + 25e-9 * np.sin(2 * phase) + 20e-9 * np.sin(2 * np.pi * 3 * y + 1)
    return prepare(HeightMap(np.rot90(heights, quarters), (pixel, pixel), "test", periodic=True))


def facets(along_b):
    """A blazed grating of 1.5 um whose order -1 takes most of the light."""
    surface = blazed(1.5e-6, 275e-9, periods=3, rows=8)
    heights = surface.height_m.T[::-1] if along_b else surface.height_m
    return prepare(HeightMap(heights, surface.pixel_size_m, "test", periodic=True))


def mirror():
    return prepare(HeightMap(np.zeros((8, 8)), (85e-9, 85e-9), "test", periodic=True))


def luminance(xyz):
    return np.nan_to_num(xyz[..., 1])


def place(image, size):
    """Coordinates (x, y) of the brightest pixel."""
    row, col = np.unravel_index(np.argmax(image), image.shape)
    return ((col, row) + np.array(0.5)) * 2 / size - 1


@pytest.mark.parametrize("size", [9, 64])
def test_a_pixel_is_a_direction(size):
    """(x, y) = (sin t cos p, sin t sin p), rows along +y; pixels outside the unit disc have no direction."""
    wi, (wr, inside) = light_from(THETA), view_hemisphere(size)
    np.testing.assert_allclose(np.linalg.norm(wr[inside], axis=-1), 1, atol=1e-12)
    axis = (2 * np.arange(size) + 1) / size - 1
    np.testing.assert_allclose(wr[..., 0], np.tile(axis, (size, 1)), atol=1e-15)
    np.testing.assert_allclose(wr[..., 1], np.tile(axis[:, None], (1, size)), atol=1e-15)
    np.testing.assert_array_equal(inside, np.hypot(wr[..., 0], wr[..., 1]) < 1)
    np.testing.assert_allclose(wi, [-np.sin(THETA), 0, np.cos(THETA)], atol=1e-15)


def test_the_mirror_image_of_the_light_lies_towards_x():
    size = 60
    xyz = from_reference(mirror(), SIGMA_B, size, wi=light_from(THETA), seen=seen_colour(100e-9))
    light, axis = np.nan_to_num(luminance(xyz)), (np.arange(size) + 0.5) * 2 / size - 1
    x, y = (axis @ light.sum(axis=along) / light.sum() for along in (0, 1))
    # To half a pixel; the disc is symmetric except for Fresnel, which moves its middle by sigma^2 R'/R, here 0.003.
    assert (x, y) == pytest.approx((np.sin(THETA), 0), abs=1.5 / size)


def scattering(wi, view, *, stam):
    """The factor of the scattered light over w^2, for a unit vector to the light and one to the viewer."""
    if stam:
        return fresnel_reflectance(np.linalg.norm(wi + view) / 2) * (1 + wi @ view) ** 2 / view[2]
    return 4 * wi[2] ** 2 * view[2] * small_slope_reflectance(wi, view)


@pytest.mark.parametrize("stam", [False, True])
@pytest.mark.parametrize("theta_i", [0.0, THETA])
def test_the_exact_map_is_the_reference(theta_i, stam):
    """At 20 pixels, each with its own w, in both forms. The series leaves 1e-9 of its largest value. Cutting
    the kernel at 5.5 sigma instead of 7 leaves at most exp(-5.5^2 / 2) = 2.7e-7 of an order's peak for each of the few
    orders there: 1e-6 of the peak."""
    size = 40
    relief = skin()
    xyz = from_reference(relief, SIGMA_B, size, wi=light_from(theta_i), seen=seen_colour(STEP_M), stam=stam)
    wi, (wr, inside) = light_from(theta_i), view_hemisphere(size)
    pixels = np.random.default_rng(0).permutation(np.argwhere(inside))[:20]
    for row, col in pixels:
        view = wr[row, col]
        u, v, w = wi + view
        scattered, zero = reference_xyz(relief, (np.array([u]), np.array([v])), w=w, sigma_b=SIGMA_B, step_m=STEP_M)
        kernel = mirror_kernel(wi, view, variance=SIGMA_B**2)
        reflectance = fresnel_reflectance(np.linalg.norm(wi + view) / 2)
        factor = scattering(wi, view, stam=stam)
        expected = factor / w**2 * scattered[0] + reflectance * zero * kernel
        np.testing.assert_allclose(xyz[row, col], expected, rtol=0, atol=1e-6 * np.nanmax(xyz))


def test_a_mirror_is_white_everywhere():
    """Every pixel is R times the kernel, in one colour, to a rounding."""
    xyz = from_reference(mirror(), 0.3, 24, wi=light_from(THETA), seen=seen_colour(50e-9))
    seen = xyz[xyz[..., 1] > 0]
    np.testing.assert_allclose(seen / seen[:, 1:2], np.tile(white_xyz(), (len(seen), 1)), rtol=1e-11)


def test_the_map_of_a_bake_has_the_colours_of_the_reference():
    """Exposed to the orders, as a picture is. The bake's budget is a 99th percentile of 1 over the metric's pairs; for
    these other pairs the test allows twice that, and half of the budget on the mean."""
    relief, size = skin(), 48
    table = bake(relief, BakeRequest(coherence_length_m=COHERENCE_M))
    assert table.sigma_b == pytest.approx(SIGMA_B, rel=1e-4)
    for theta_i in (0.0, THETA):
        exact = from_reference(relief, table.sigma_b, size, wi=light_from(theta_i), seen=seen_colour(5e-9))
        baked = from_bake(table, size, light_from(theta_i))
        np.testing.assert_array_equal(np.isnan(exact), np.isnan(baked))
        seen = np.isfinite(exact[..., 1])
        level = np.percentile(exact[seen][:, 1], 90)
        shown = seen & (luminance(exact) < level)
        difference = delta_e_2000(*(lab(xyz[shown] / level, white_xyz()) for xyz in (exact, baked)))
        assert np.percentile(difference, 99) < 2
        assert difference.mean() < 0.5


@pytest.mark.parametrize("stam", [False, True])
def test_the_map_of_a_table_known_in_closed_form(stam):
    """B_0 = 3 and Z = 2 everywhere: 3 times the factor of the scattered light, and 2 R times the kernel."""
    table = Table(np.full((1, 16, 16, 3), 3.0), np.full((5, 3), 2.0), 0.4, 4 / 12, "D65")
    size = 15
    xyz = from_bake(table, size, light_from(THETA), stam=stam)
    wi, (wr, inside) = light_from(THETA), view_hemisphere(size)
    for row, col in np.argwhere(inside)[::7]:
        view = wr[row, col]
        half = wi + view
        kernel = mirror_kernel(wi, view, variance=0.4**2)
        reflectance = fresnel_reflectance(np.linalg.norm(half) / 2)
        expected = 3 * scattering(wi, view, stam=stam) + 2 * reflectance * kernel
        np.testing.assert_allclose(xyz[row, col], expected, rtol=1e-12)
    assert np.isnan(xyz[~inside]).all()


@pytest.mark.parametrize("method", ["bake", "reference"])
@pytest.mark.parametrize("along_b", [False, True])
def test_facets_send_light_down_their_slope(method, along_b):
    """A surface that rises along T sends its order to -x of the mirror image, one that rises along B to -y: by
    lam / period, which is 0.37 for green. Neighbouring orders share the colours, so the tolerance is 0.06."""
    relief, size = facets(along_b), 64
    table = bake(relief, BakeRequest(delta_e=5, coherence_length_m=COHERENCE_M))
    for theta_i in (0.0, np.radians(20)):
        if method == "bake":
            image = luminance(from_bake(table, size, light_from(theta_i)))
        else:
            image = luminance(
                from_reference(relief, table.sigma_b, size, wi=light_from(theta_i), seen=seen_colour(20e-9))
            )
        x, y = place(image, size)
        order = np.array([0, -0.37] if along_b else [-0.37, 0])
        assert (x, y) == pytest.approx((np.sin(theta_i), 0) + order, abs=0.06)


def test_row_zero_of_the_picture_is_plus_y():
    size = 48
    shown = picture(
        from_bake(
            bake(facets(along_b=True), BakeRequest(delta_e=5, coherence_length_m=COHERENCE_M)), size, light_from(0.0)
        )
    )
    _, inside = view_hemisphere(size)
    brightness = shown.sum(axis=-1) * inside
    assert brightness[size // 2 :].sum() > 2 * brightness[: size // 2].sum()


def test_a_picture_is_exposed_encoded_and_white_around():
    """The 99.5th percentile of Y becomes 1; a grey of half of that is sRGB's 188."""
    size = 64
    _, inside = view_hemisphere(size)
    grey = np.full((size, size, 3), np.nan)
    grey[inside] = 0.5 * white_xyz()
    grey[size // 2 - 3 : size // 2 + 3, size // 2 - 3 : size // 2 + 3] = white_xyz()
    shown = picture(grey)
    assert shown.dtype == np.uint8 and shown.shape == (size, size, 3)
    assert (shown[~inside[::-1]] == 255).all()
    assert (shown[size // 2, 2] == round(255 * float(srgb_encode(0.5)))).all()
    assert (shown[size // 2, size // 2] == 255).all()
    np.testing.assert_array_equal(picture(grey * 1e-7), shown)


def test_the_upper_half_of_a_picture_is_plus_y():
    xyz = np.zeros((8, 8, 3))
    xyz[6:] = white_xyz()
    np.testing.assert_array_equal(picture(xyz)[:2], 255)
    np.testing.assert_array_equal(picture(xyz)[2:], 0)


def test_a_picture_of_nothing_is_black():
    assert not picture(np.zeros((8, 8, 3))).any()


def test_a_picture_of_one_bright_pixel_shows_it():
    xyz = np.zeros((32, 32, 3))
    xyz[4, 5] = 1e-9 * white_xyz()
    assert (picture(xyz)[32 - 1 - 4, 5] == 255).all()


def test_linear_rgb_is_rec_709():
    xyz = np.random.default_rng(0).uniform(0, 1, (3, 4, 3))
    np.testing.assert_allclose(linear_rgb(xyz)[1, 2], rgb_from_xyz("Rec.709") @ xyz[1, 2], rtol=1e-12)
    np.testing.assert_allclose(linear_rgb(np.tile(white_xyz("E"), (2, 2, 1)), "E"), 1, rtol=1e-12)


@pytest.mark.parametrize("matter", ["dielectric", "gold"])
def test_a_map_of_a_bake_is_the_formula_of_the_materials(matter):
    relief = prepare(blazed(periods=2, rows=64))
    table = bake(relief, BakeRequest(delta_e=3, coherence_length_m=COHERENCE_M, matter=parse(matter)))
    wi, (wr, inside) = light_from(THETA), view_hemisphere(48)
    views = wr[inside]
    lamp = {"irradiance": np.ones((1, 3)), "variance": table.kernel_variance}
    expected = lamp_radiance(table, np.broadcast_to(wi, views.shape), views, **lamp)
    found = shown_rgb(from_bake(table, 48, light_from(THETA))[inside], rgb_from_xyz())
    # The table is in single precision.
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * expected.max())


def test_progress_is_told_for_each_wavelength():
    told = []
    from_reference(
        mirror(), 0.3, 8, wi=light_from(0.0), seen=seen_colour(100e-9), progress=lambda *each: told.append(each)
    )
    assert told == [("reference", (k + 1) / 5) for k in range(5)]


def test_light_from_another_side_is_the_surface_turned_back():
    """The relief turned by a quarter of a turn, under light turned by as much, is the same picture turned. Row 0 of a
    map is -y and row 0 of a height map +y, so numpy turns the one clockwise and the other counterclockwise."""
    size, seen = 24, seen_colour(50e-9)
    plain = from_reference(skin(), SIGMA_B, size, wi=light_from(THETA), seen=seen)
    wi = light_from(THETA, np.radians(90))
    other = from_reference(skin(quarters=1), SIGMA_B, size, wi=wi, seen=seen)
    np.testing.assert_allclose(np.rot90(plain, -1), other, rtol=0, atol=1e-6 * np.nanmax(plain))


def test_a_spectrum_summed_with_the_observer_is_the_colour():
    relief, size = skin(), 16
    seen = seen_colour(80e-9)
    spectrum = from_reference(relief, SIGMA_B, size, wi=light_from(THETA), seen=seen_spectrum(seen.lambdas))
    assert spectrum.shape == (size, size, 6)
    colour = from_reference(relief, SIGMA_B, size, wi=light_from(THETA), seen=seen)
    np.testing.assert_allclose(spectrum @ seen.weights, colour, rtol=0, atol=1e-12 * np.nanmax(colour))
    method = METHODS["reference"](relief, Settings(coherence_length_m=COHERENCE_M, step_m=80e-9))
    one = from_method(method, size, light_from(THETA), lambdas_m=seen.lambdas)
    all_at_once = from_method(method, size, light_from(THETA))
    np.testing.assert_allclose(one @ seen.weights, all_at_once, rtol=0, atol=1e-12 * np.nanmax(all_at_once))
