# SPDX-License-Identifier: GPL-3.0-or-later
"""Real files of instruments and programs, compared with what another program read from them. The table was made by
tests/precompute/surface/make_oracle.py from the package SurfaceTopography."""

import json
from pathlib import Path

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.height_map import level_plane
from precompute.surface.readers.reader_registry import read_height_map, reader_of

TABLE = json.loads((Path(__file__).parent / "oracle.json").read_text())
# The other program's default is another channel.
CHANNELS = {
    "afmreader_sample_0.jpk": "Height retrace",
    "afmreader_sample_0.jpk-qi-image": "Height (measured) trace (1)",
}
# It computes Park's floating values in single precision: 24 bits of the raw numbers' range.
SINGLE = {"st_example_ps.tiff": 2.0**-23}


@pytest.mark.parametrize("name", TABLE)
def test_real_files_are_read_as_another_program_reads_them(shared_data, name):
    expected = TABLE[name]
    path = str(next(shared_data.rglob(name)))
    height_map = reader_of(path).read(path, channel=CHANNELS.get(name))  # skips the limits on sizes
    height = height_map.height_m
    assert list(height.shape) == expected["shape"]
    assert height_map.size_m == pytest.approx(expected["size_m"], rel=1e-7)
    assert int(np.isnan(height).sum()) == expected["missing"]
    # Both compute in double precision, with factors in another order.
    tolerance = SINGLE.get(name, 1e-13) * np.nanmax(np.abs(height))
    found = (np.nanmin(height), np.nanmax(height), np.nanstd(height))
    np.testing.assert_allclose(found, [expected[key] for key in ("lowest", "highest", "rms")], rtol=0, atol=tolerance)
    corners = [height[row, col] for row in (0, -1) for col in (0, -1)]
    wanted = [np.nan if corner is None else corner for corner in expected["corners"]]
    np.testing.assert_allclose(corners, wanted, rtol=0, atol=tolerance)


def test_the_nanoscope_file_levelled_is_gwyddions_export_of_it(shared_data):
    """Not flipped and in metres; the export has five digits of heights up to 0.24 um, so 5e-12 m at most."""
    levelled = level_plane(read_height_map(str(shared_data / "formats" / "st_di-3.di")))
    exported = read_height_map(str(shared_data / "formats" / "st_matrix-3.txt"))
    assert (levelled.channel, exported.channel) == ("ZSensor trace", "ZSensor")
    again = level_plane(exported).height_m
    reach = np.ptp(again)
    assert reach == pytest.approx(408.83e-9, rel=1e-5)
    difference = np.abs(levelled.height_m - again)
    assert np.sqrt(np.mean(difference**2)) < 5e-12
    assert difference.max() <= 1e-6 * reach + 5.1e-12
    assert levelled.pixel_size_m == pytest.approx(exported.pixel_size_m, rel=1e-12)


def test_the_real_grid_is_one_height_map_through_its_text(shared_data):
    """The text holds seven digits of numbers up to 1.03 um."""
    folder = shared_data / "nanosurf"
    text, nid = (read_height_map(str(folder / name)) for name in ("grid_gwyddion.txt", "grid.nid"))
    np.testing.assert_allclose(text.height_m, nid.height_m, rtol=0, atol=0.6e-12)
    assert text.pixel_size_m == pytest.approx(nid.pixel_size_m, rel=1e-12)


def test_the_corrupted_file_is_refused_in_one_line(shared_data):
    with pytest.raises(GratingError, match=r"^[^\n]*truncated[^\n]*; [^\n]*$"):
        read_height_map(str(shared_data / "formats" / "st_di_corrupted.di"))


@pytest.mark.parametrize(
    "name, fault",
    [
        ("st_10x10-one_channel_without_name.ibw", "'unnamed' has no unit of height; "),
        ("gwyfile_test.gwy", "'Test' has no unit of height; "),
        ("st_sur-3.sur", "relief of 0.00699 m"),  # 15 cm wide
        ("x3ptools_pyramid.x3p", "5 x 5 points"),
        ("st_gwyddion-export-german.txt", "4 x 3 points"),
        ("st_matrix-6.txt", "3 x 4 points"),
    ],
)
def test_what_is_no_scan_of_a_grating_is_refused_by_its_sizes(shared_data, name, fault):
    with pytest.raises(GratingError, match=fault):
        read_height_map(str(shared_data / "formats" / name))


def test_the_points_of_a_real_grid_stand_upright(shared_data):
    """Of (x, y, z) the highest are (1, 1) and (1, 2) of 4 x 4; the file's y points up."""
    path = str(shared_data / "formats" / "st_xyz-1.txt")
    height_map = reader_of(path).read(path, size_um=4.0, height_nm=1.0)  # skips the limits on sizes
    assert height_map.size_m == pytest.approx((4e-6, 4e-6))
    assert np.argwhere(height_map.height_m > 1.5e-9).tolist() == [[1, 1], [2, 1]]
