# SPDX-License-Identifier: GPL-3.0-or-later
"""Common to all readers: orientation and units, detection, refusals, damaged files."""

import inspect
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import (
    READERS,
    described,
    extensions,
    file_filter,
    read_height_map,
    reader_of,
)
from precompute.surface.readers.scan_file import Reader
from tests.precompute.surface.scan_files import (
    GREY8,
    GREY16,
    HALF_STEP_8,
    HALF_STEP_16,
    PIXEL_M,
    TILTED,
    gwy_bytes,
    nid_bytes,
    picture,
    read_picture,
)


def test_one_tilted_surface_through_every_format(tmp_path):
    (tmp_path / "tilted.nid").write_bytes(nid_bytes(TILTED))
    (tmp_path / "tilted.gwy").write_bytes(gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED}))
    maps = {
        "nid": (read_height_map(str(tmp_path / "tilted.nid")), 8e-7 / 2**32),
        "gwy": (read_height_map(str(tmp_path / "tilted.gwy")), 0),
        "png 16": (read_picture(picture(tmp_path / "16.png", GREY16)), HALF_STEP_16),
        "png 8": (read_picture(picture(tmp_path / "8.png", GREY8)), HALF_STEP_8),
        "tiff 16": (read_picture(picture(tmp_path / "16.tif", GREY16)), HALF_STEP_16),
        "tiff 8": (read_picture(picture(tmp_path / "8.tiff", GREY8, compression="tiff_lzw")), HALF_STEP_8),
        "bmp": (read_picture(picture(tmp_path / "8.bmp", GREY8)), HALF_STEP_8),
    }
    for name, (hm, rounding) in maps.items():
        # Heights differ by half a quantisation step, and by the rounding of the scale factors.
        np.testing.assert_allclose(hm.height_m, TILTED, rtol=0, atol=rounding + 1e-21, err_msg=name)
        assert hm.pixel_size_m == pytest.approx((PIXEL_M, PIXEL_M), rel=1e-12), name
        assert not hm.periodic


def test_the_real_grid_is_the_same_through_four_files(shared_data):
    folder = shared_data / "nanosurf"
    nid = read_height_map(str(folder / "grid.nid"))
    gwy = read_height_map(str(folder / "grid.gwy"))
    png = read_height_map(str(folder / "grid_16bit.png"), size_um=3.0, height_nm=302.626506663)
    np.testing.assert_allclose(nid.height_m, gwy.height_m, rtol=1e-12)
    # The text file holds seven digits of numbers up to 1.2 um.
    np.testing.assert_allclose(nid.height_m, np.loadtxt(folder / "grid_gwyddion.txt"), rtol=0, atol=0.6e-12)
    # Heights in the picture start at its lowest pixel and have steps of 302.6 nm / 65535.
    above_lowest = nid.height_m - nid.height_m.min()
    np.testing.assert_allclose(above_lowest, png.height_m, rtol=0, atol=0.51 * 302.63e-9 / 65535)
    assert nid.pixel_size_m == gwy.pixel_size_m == png.pixel_size_m == (3e-6 / 256, 3e-6 / 256)
    assert (nid.channel, gwy.channel) == ("Z-Axis forward", "Z-Axis")


def test_the_real_skin_is_grey_in_rgba(shared_data):
    hm = read_height_map(str(shared_data / "snake" / "elaphe_65um.png"), size_um=65, height_nm=375)
    assert (hm.rows, hm.cols) == (1332, 1332)
    assert np.ptp(hm.height_m) == pytest.approx(375e-9, rel=1e-12)


def test_the_compressed_palette_bmp_is_grey(shared_data):
    hm = read_height_map(str(shared_data / "snake" / "blaze200_synthetic.bmp"), size_um=2.5, height_nm=246.23)
    facet = hm.height_m[0, :-1]
    assert (np.diff(facet) > 0).all()


def test_magic_decides_and_a_lying_extension_is_told(fails, tmp_path):
    assert "rename it to .nid" in fails("scan.png", nid_bytes(TILTED), size_um=1, height_nm=1)
    assert "does not begin like Nanosurf" in fails("scan.nid", b"something else entirely")
    assert "does not begin like PNG" in fails("scan.png", b"something else entirely")
    told = fails("scan.unknown", b"something else entirely")
    assert "--convert-to-gwy=OUT.gwy IN, or export it as one of .nid, .gwy, .gsf, .spm" in told
    (tmp_path / "no_extension").write_bytes(nid_bytes(TILTED))
    assert read_height_map(str(tmp_path / "no_extension")).channel == "Z-Axis forward"


@pytest.mark.parametrize("extension", extensions())
def test_an_empty_file_a_directory_and_a_missing_file(fails, tmp_path, extension):
    assert "empty" in fails(f"none{extension}", b"", size_um=1, height_nm=1)
    (tmp_path / f"folder{extension}").mkdir()
    with pytest.raises(GratingError, match="is a directory; "):
        read_height_map(str(tmp_path / f"folder{extension}"))
    with pytest.raises(GratingError, match="cannot be read .*; "):
        read_height_map(str(tmp_path / f"missing{extension}"))


def test_sizes_are_refused_where_they_would_be_ignored(fails):
    told = fails("scan.nid", nid_bytes(TILTED), height_nm=1)
    assert "leave out --height-nm" in told
    with pytest.raises(GratingError, match="sample:blazed: .*leave out --size-um"):
        read_height_map("sample:blazed", size_um=65)


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_every_reader_keeps_the_protocol(reader):
    assert isinstance(reader, Reader)
    assert isinstance(reader.name, str) and isinstance(reader.needs_size, bool)
    assert all(each.startswith(".") and each == each.lower() for each in reader.extensions)
    assert reader.can_read(b"") is False
    for method in ("can_read", "channels", "read"):
        wanted, own = (inspect.signature(getattr(each, method)) for each in (Reader, reader))
        assert list(wanted.parameters.values())[1:] == list(own.parameters.values())
        assert wanted.return_annotation == own.return_annotation


def test_names_and_extensions_are_unique():
    names = [reader.name for reader in READERS]
    assert len(set(names)) == len(names)
    assert len(set(extensions())) == len(extensions())


def test_filter_and_description_name_every_format():
    patterns = file_filter().split(";")
    assert patterns[:6] == ["*.nid", "*.gwy", "*.gsf", "*.spm", "*.di", "*.[0-9][0-9][0-9]"]
    # Blender's file browser keeps 255 bytes of a filter.
    assert len(file_filter().encode()) < 256
    for reader in READERS:
        assert any(fnmatch(f"scan{extension}", each) for extension in reader.extensions for each in patterns)
        assert f"{reader.name} {reader.extensions[0]}" in described()
    assert described().startswith("Nanosurf .nid, Gwyddion .gwy, ")
    assert "; and, with a size given, PNG .png, TIFF .tif, BMP .bmp, " in described()


def test_the_page_of_formats_names_every_extension():
    page = (Path(__file__).resolve().parents[3] / "docs" / "formats.md").read_text()
    assert not [extension for extension in extensions() if extension not in page]


@pytest.mark.parametrize("extension", [".000", ".007", ".999", ".SPM"])
def test_files_that_are_counted_are_known(fails, extension):
    assert "does not begin like Bruker NanoScope" in fails(f"scan{extension}", b"something else entirely")


def test_the_registry_imports_no_decoder():
    """Blender loads the registry at its start; a decoder is loaded with the first file that needs it."""
    code = "import sys, precompute.surface.readers.reader_registry; print({'PIL', 'OpenEXR'} & set(sys.modules))"
    root = Path(__file__).resolve().parents[3]
    answer = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "set()"


@pytest.mark.parametrize("kind", ["nid", "gwy", "png"])
def test_channels_are_listed_without_reading(tmp_path, kind):
    path = str(tmp_path / f"tilted.{kind}")
    if kind == "png":
        picture(path, GREY8)
        hm = read_picture(path)
    else:
        data = nid_bytes(TILTED) if kind == "nid" else gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED})
        Path(path).write_bytes(data)
        hm = read_height_map(path)
    assert tuple(channel.label for channel in reader_of(path).channels(path)) == hm.channels


@pytest.mark.parametrize("name", ["nanosurf/grid.nid", "nanosurf/grid.gwy", "formats/st_nid-1.nid"])
def test_channels_of_real_files_are_those_that_reading_tells(shared_data, name):
    path = str(shared_data / name)
    labels = tuple(channel.label for channel in reader_of(path).channels(path))
    assert len(labels) > 0
    assert labels == read_height_map(path).channels


def test_the_real_picture_has_no_channels(shared_data):
    path = str(shared_data / "nanosurf" / "grid_16bit.png")
    assert reader_of(path).channels(path) == read_height_map(path, size_um=3.0, height_nm=302.6).channels == ()


def picture_bytes(path):
    return open(picture(path, GREY8), "rb").read()


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(["nid", "gwy", "png", "tif", "bmp"]), st.integers(0, 2**32), st.booleans())
def test_a_damaged_file_is_read_or_refused_and_never_more(tmp_path_factory, kind, seed, cut):
    """The file is cut anywhere, or some bytes are overwritten, mostly in the header."""
    folder = tmp_path_factory.getbasetemp()
    whole = {"nid": nid_bytes(TILTED), "gwy": gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED})}.get(
        kind
    ) or picture_bytes(folder / f"whole.{kind}")
    rng = np.random.default_rng(seed)
    data = bytearray(whole[: rng.integers(1, len(whole))] if cut else whole)
    for place in [] if cut else rng.integers(min(len(data), 2000), size=rng.integers(1, 6)):
        data[place] = rng.integers(256)
    path = folder / f"damaged.{kind}"
    path.write_bytes(data)
    sizes = {} if kind in ("nid", "gwy") else {"size_um": 1.0, "height_nm": 200.0}
    try:
        hm = read_height_map(str(path), **sizes)
    except GratingError as error:
        assert str(error).startswith(f"{path}: ") and "; " in str(error) and "\n" not in str(error)
    else:
        assert hm.height_m.size <= 1400 * 8 * len(data)
