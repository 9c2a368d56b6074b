# SPDX-License-Identifier: GPL-3.0-or-later
"""Rare headers and missing points, put into real files and compared with Gwyddion's values.

The figures below come from Gwyddion 2.62: from the fields and masks that `gwyddion --convert-to-gwy=OUT.gwy IN` made of
the files that these tests make. docs/formats.md says where both differ."""

import hashlib
import struct
import zipfile

import numpy as np
import pytest

from precompute.surface.readers.reader_registry import read_height_map

# Lowest height, highest height and rms of the points that Gwyddion takes as measured.
X3P_DOUBLES = (-3.144206865877671e-07, 2.3991551341223285e-07, 7.728448176322416e-08)
X3P_FLOATS = (-3.1442067438547383e-07, 2.3991552211555245e-07, 7.728448176395781e-08)
IBW = (-7.046238579277997e-07, -3.3123345133390103e-07, 8.945481491256413e-08)
SUR_STEP_M, SUR_HIGHEST_M = 1.0000000474974513e-10, 1.0388000493403523e-05
SDF = (9.7358e-07, 1.09195e-06, 3.1036300287927606e-08)
HOLES = ((0, 0), (2, 5), (7, 13), (4, 9))


def read(folder, name, data):
    (folder / name).write_bytes(data)
    return read_height_map(str(folder / name))


def holds(height, missing, figures):
    """Check a map's number of missing points and its figures, to the last digits of the rms, a sum."""
    assert np.isnan(height).sum() == missing
    found = np.nanmin(height), np.nanmax(height), np.nanstd(height)
    assert found[:2] == figures[:2]
    assert found[2] == pytest.approx(figures[2], rel=1e-12)


@pytest.mark.parametrize("kind, letter, figures", [("<f8", "D", X3P_DOUBLES), ("<f4", "F", X3P_FLOATS)])
def test_infinite_points_of_a_real_x3p(shared_data, tmp_path, kind, letter, figures):
    """1000 points each of infinity, minus infinity and NaN in st_x3p-2.x3p."""
    with zipfile.ZipFile(shared_data / "formats" / "st_x3p-2.x3p") as archive:
        xml, data = archive.read("main.xml").decode(), archive.read("bindata/data.bin")
    values = np.frombuffer(data, "<f8").copy()
    places = np.random.default_rng(7).choice(values.size, (3, 1000), replace=False)
    for place, value in zip(places, (np.inf, -np.inf, np.nan), strict=True):
        values[place] = value
    stored = values.astype(kind).tobytes()
    xml = xml.replace("<DataType>D<", f"<DataType>{letter}<")
    xml = xml.replace("33EE4E6B66F3CC7F84C5728FC1AE5A03", hashlib.md5(stored).hexdigest().upper())
    with zipfile.ZipFile(tmp_path / "holes.x3p", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("bindata/data.bin", stored)
    height = read_height_map(str(tmp_path / "holes.x3p")).height_m
    assert np.array_equal(np.flatnonzero(np.isnan(height)), np.sort(places, axis=None))
    holds(height, 3000, figures)


@pytest.mark.parametrize("units", [(148,), (148, 152, 156)], ids=["values", "values and sides"])
def test_a_real_wave_without_units(shared_data, tmp_path, units):
    """st_spot_1-1000nm.ibw without its units. Gwyddion reads heights in metres, and sides of 20.08 um."""
    data = bytearray((shared_data / "formats" / "st_spot_1-1000nm.ibw").read_bytes())
    for at in units:
        data[64 + at : 68 + at] = bytes(4)
    data[2:4] = bytes(2)
    data[2:4] = struct.pack("<H", -sum(struct.unpack("<192h", data[:384])) & 0xFFFF)
    scan = read(tmp_path, "bare.ibw", data)
    holds(scan.height_m, 0, IBW)
    assert scan.channel == "Height trace" and scan.size_m == (2.007843137254902e-05, 2.007843137254902e-05)


@pytest.mark.parametrize("sign", ["\xb5m".encode("latin-1"), "\xb5m".encode(), "\u03bcm".encode()])
def test_micrometres_of_a_real_sur(shared_data, tmp_path, sign):
    """st_sur-2.sur in micrometres. Gwyddion takes its 117 missing points as heights two steps below the lowest."""
    data = bytearray((shared_data / "formats" / "st_sur-2.sur").read_bytes())
    for unit, step, axis in ((180, 120, 228), (196, 124, 244), (212, 128, 260)):
        assert data[unit : unit + 16].strip() == b"mm"
        data[unit : unit + 16] = data[axis : axis + 16] = sign.ljust(16)
        struct.pack_into("<f", data, step, 1000 * struct.unpack_from("<f", data, step)[0])
    scan = read(tmp_path, "micro.sur", data)
    assert scan.size_m == (0.0016862560997009275, 0.0019614921159744263)
    assert np.isnan(scan.height_m).sum() == 117
    assert np.nanmax(scan.height_m) == SUR_HIGHEST_M
    assert np.nanmin(scan.height_m) == pytest.approx(8.911800423287787e-06 + 2 * SUR_STEP_M, rel=1e-14)


def sdf(shared_data, largest, *, binary):
    """st_sdf-1.sdf repeated 2 x 2, with all heights different and four holes."""
    head, body, trailer = (shared_data / "formats" / "st_sdf-1.sdf").read_text().split("*\n", 2)
    values = np.tile([[float(each) for each in line.split()] for line in body.splitlines()], (2, 2))
    values += np.arange(values.size).reshape(values.shape) * 1e-3
    for place in HOLES:
        values[place] = largest
    if binary:
        stamps = b"bISO-1.0", b"ISOTC213  ", b"040120100853", b"050320101353"
        return struct.pack("<8s10s12s12s2H4d3B", *stamps, 14, 8, 1e-6, 1e-6, 1e-6, 1e-9, 0, 7, 0) + values.tobytes()
    head = head.replace("NumPoints = 7", "NumPoints = 14").replace("NumProfiles = 4", "NumProfiles = 8")
    rows = "\n".join(" ".join(repr(float(each)) for each in row) for row in values)
    return f"{head}*\n{rows}\n*\n{trailer}".encode()


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("largest", [np.nan, np.finfo("f8").max])
def test_holes_of_a_real_sdf(shared_data, tmp_path, binary, largest):
    """Gwyddion takes NaN as missing only in binary files, and DBL_MAX as a height; all other values agree."""
    height = read(tmp_path, "holes.sdf", sdf(shared_data, largest, binary=binary)).height_m
    assert sorted(map(tuple, np.argwhere(np.isnan(height)).tolist())) == sorted(HOLES)
    holds(height, 4, SDF)
