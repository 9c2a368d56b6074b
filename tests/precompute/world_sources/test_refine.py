# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from precompute.world_sources.sources import crop_cells, fit_closely, panorama_cells
from tests.precompute.world_sources.worlds import COLS, ROWS, direction, disc, picture, sky

FINE = 9


def seen(directions, suns, spread):
    """Radiance (n, 3) of a sky with `suns`, discs (direction, radius, radiance) with edges a pixel wide."""
    total = np.where(directions[:, 2] > 0, 0.3 + 0.7 * directions[:, 2], 0.1)
    for towards, radius, radiance in suns:
        # The chord stays exact for tiny angles.
        angle = 2 * np.arcsin(np.linalg.norm(directions - towards, axis=1) / 2)
        total = total + radiance * np.clip((radius - angle) / spread + 0.5, 0, 1)
    return total[:, None] * (0.8, 1.0, 1.2)


def looks_at(suns):
    """A function that renders crops of such a world, and a list that collects the half angles of its calls."""
    asked = []

    def look(towards, half_angle, size):
        asked.append(half_angle)
        cells = crop_cells(size, half_angle, towards)
        return seen(cells.directions, suns, 2 * half_angle / size).reshape(size, size, 3)

    return look, asked


def panorama_of(suns):
    """A panorama with each pixel the mean of FINE x FINE, like a render with samples."""
    fine = panorama_cells(ROWS * FINE, COLS * FINE)
    light = seen(fine.directions, suns, np.pi / ROWS / FINE) * fine.solid_angles[:, None]
    sums = light.reshape(ROWS, FINE, COLS, FINE, 3).sum(axis=(1, 3))
    return sums / panorama_cells(ROWS, COLS).solid_angles.reshape(ROWS, COLS, 1)


@pytest.mark.night("test_one_sun_on_two_pixels_is_one_source")
@pytest.mark.parametrize(
    "towards", [(40.2, 10.3), (89.8, 20), (90, 0), (-90, 0), (0.5, 179.9), (40, 180), (40, -179.8), (-30, -100)]
)
def test_a_sun_of_half_a_degree(towards):
    """The panel promises 2 % of the light and 0.1 degrees, wherever the sun falls on pixels of 1.4 degrees."""
    radius, radiance = np.radians(0.265), 20000.0
    suns = [(direction(*towards), radius, radiance)]
    look, asked = looks_at(suns)
    [source] = fit_closely(panorama_of(suns), 8, look)
    np.testing.assert_allclose(source.irradiance, np.pi * radius**2 * radiance * np.array((0.8, 1, 1.2)), rtol=0.02)
    assert np.degrees(np.linalg.norm(source.direction - suns[0][0])) < 0.02
    # The edge and the cells of 0.05 degrees add 9/12 of (0.05/0.265)^2.
    assert source.variance == pytest.approx(radius**2 / 4, rel=0.03)
    assert len(asked) <= 2


def test_a_sun_that_no_sample_met():
    """A sun 0.1 degrees wide, whose direction is known to 0.2 degrees. It takes a second look."""
    radius = np.radians(0.05)
    suns = [(direction(40, 10), radius, 1e6)]
    look, asked = looks_at(suns)
    empty = picture(sky())
    assert fit_closely(empty, 8, look) == [] and asked == []
    [source] = fit_closely(empty, 8, look, suns=[direction(40.2, 10)])
    assert source.irradiance[1] == pytest.approx(np.pi * radius**2 * 1e6, rel=0.02)
    assert source.variance == pytest.approx(radius**2 / 4, rel=0.03)
    assert len(asked) >= 2


@pytest.mark.night("test_one_sun_on_two_pixels_is_one_source")
def test_a_sun_that_is_not_there_or_is_known_already():
    look, _ = looks_at([])
    assert fit_closely(picture(sky()), 8, look, suns=[direction(40, 10)]) == []
    suns = [(direction(40, 10), np.radians(0.265), 20000.0)]
    look, _ = looks_at(suns)
    assert len(fit_closely(panorama_of(suns), 8, look, suns=[direction(40, 10)])) == 1


def test_a_sun_in_front_of_a_bright_cloud_is_counted_once():
    """The cloud's source holds the light of its cone minus the sun's, which its own pixels measure only roughly."""
    sun = (direction(40, 10), np.radians(0.265), 60000.0)
    cloud = (direction(40, 16), np.radians(7), 30.0)
    look, _ = looks_at([sun, cloud])
    world = panorama_of([sun, cloud])
    first, second = fit_closely(world, 2, look)
    small, wide = sorted((first, second), key=lambda source: source.variance)
    assert small.irradiance[1] == pytest.approx(np.pi * sun[1] ** 2 * sun[2], rel=0.02)
    total = small.irradiance[1] + wide.irradiance[1]
    # The cloud's light is 2 pi (1 - cosine); its cone also holds some sky of at most 1.
    cloud_light = 2 * np.pi * (1 - np.cos(cloud[1])) * cloud[2]
    assert total == pytest.approx(np.pi * sun[1] ** 2 * sun[2] + cloud_light, rel=0.04)


def test_a_small_sun_before_a_cloud_is_found_and_one_that_is_not_there_takes_no_light():
    cloud = (direction(40, 16), np.radians(12), 3.0)
    sun = (direction(40, 10), np.radians(0.05), 1e6)
    look, _ = looks_at([cloud])
    without = panorama_of([cloud])
    quarters = fit_closely(without, 4, look)
    again = fit_closely(without, 4, look, suns=[sun[0]])
    assert len(quarters) == len(again) == 4
    light, light_again = (sum(quarter.irradiance for quarter in found) for found in (quarters, again))
    # Around the sun, where the cloud is even, there are finer pixels up to the edges of the others: a twentieth of
    # these 3 degrees and of the cloud's 12 each.
    np.testing.assert_allclose(light_again, light, rtol=3e-3)
    look, _ = looks_at([cloud, sun])
    small, *wide = sorted(fit_closely(without, 5, look, suns=[sun[0]]), key=lambda source: source.variance)
    assert small.irradiance[1] == pytest.approx(np.pi * sun[1] ** 2 * sun[2], rel=0.02)
    assert len(wide) == 4
    np.testing.assert_allclose(sum(source.irradiance for source in wide), light, rtol=1e-2)


def test_one_sun_on_two_pixels_is_one_source():
    """Half a degree across the edge of two pixels, in a bright sky as in a picture of a sunrise."""
    edge = np.degrees(np.pi) / COLS * 2 * 3
    suns = [(direction(8 * 180 / ROWS, edge), np.radians(0.5), 9000.0), (direction(8, edge), np.radians(8), 20.0)]
    look, _ = looks_at(suns)
    found = fit_closely(panorama_of(suns), 8, look)
    axes = [tuple(np.round(source.direction, 3)) for source in found]
    assert len(set(axes)) == len(axes)
    assert found[0].irradiance[1] == pytest.approx(np.pi * np.radians(0.5) ** 2 * 9020, rel=0.02)


def test_a_pixel_that_is_no_number_spoils_nothing():
    suns = [(direction(40, 10), np.radians(0.265), 20000.0)]
    look, _ = looks_at(suns)
    world = panorama_of(suns)
    [clean] = fit_closely(world, 8, look)
    world[3, 5] = np.nan
    [source] = fit_closely(world, 8, lambda *asked: np.where(look(*asked) < 1, np.nan, look(*asked)))
    np.testing.assert_allclose(source.irradiance, clean.irradiance, rtol=1e-3)


def test_wide_sources_need_no_look():
    look, asked = looks_at([])
    world = picture(sky() + 20 * disc(direction(50, 30), 7))
    for count in (1, 2):
        assert len(fit_closely(world, count, look)) == count
    assert asked == []
