# SPDX-License-Identifier: GPL-3.0-or-later
"""X3P files as other programs write them, and malformed ones. Gwyddion 2.62 reads the same heights, to the last digit,
from points in main.xml as `test_points_in_the_xml`."""

import io
import os
import struct
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers import iso_25178 as x3p
from precompute.surface.readers.reader_registry import read_height_map
from tests.hostile import instruments
from tests.precompute.surface.scan_files import NID_CHANNELS, PIXEL_M, TILTED, nid_bytes

LINK = "<DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink>"


def members_of(whole):
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def zipped(members, method=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return out.getvalue()


def read(folder, data):
    (folder / "made.x3p").write_bytes(data)
    return read_height_map(str(folder / "made.x3p"))


def with_xml(change, height=TILTED):
    members = members_of(instruments.x3p(height, PIXEL_M))
    return zipped(members | {"main.xml": change(members["main.xml"].decode())})


@pytest.mark.parametrize("prefix", ["", "{x:.9g};{y:.9g};", ";;"])
def test_points_in_the_xml(tmp_path, prefix):
    """Points as z, as x, y and z, or with empty x and y; an empty point is missing. z is scaled and offset."""
    points = [
        prefix.format(x=col * PIXEL_M, y=row * PIXEL_M) + repr(float(z) * 1e9)
        for row, line in enumerate(TILTED)
        for col, z in enumerate(line)
    ]
    points[47] = ""
    listed = "".join(f"<Datum>{point}</Datum>" if point else "<Datum/>" for point in points)

    def change(xml):
        assert LINK in xml
        axis = "<DataType>D</DataType><Increment>1e-9</Increment><Offset>5e-9</Offset></CZ>"
        return xml.replace("<DataType>D</DataType></CZ>", axis).replace(LINK, f"<DataList>{listed}</DataList>")

    found = read(tmp_path, with_xml(change)).height_m
    assert np.argwhere(np.isnan(found)).tolist() == [[1, 7]]
    # Three roundings of numbers up to 205 nm.
    measured = ~np.isnan(found)
    np.testing.assert_allclose(found[measured], (TILTED + 5e-9)[measured], rtol=0, atol=3 * 2**-53 * 205e-9)


def test_too_few_points_in_the_xml(tmp_path):
    with pytest.raises(GratingError, match="24 x 40 points declared, and 2 are there"):
        read(tmp_path, with_xml(lambda xml: xml.replace(LINK, "<DataList><Datum>1</Datum><Datum/></DataList>")))


@pytest.mark.parametrize("kind", ["<f8", "<f4"])
@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
def test_infinity_is_a_missing_point(tmp_path, kind, value):
    height = TILTED.copy()
    height[2, 7] = value
    members = members_of(instruments.x3p(TILTED, PIXEL_M))
    letter = {"<f8": "D", "<f4": "F"}[kind]
    xml = members["main.xml"].decode().replace(">D</DataType></CZ>", f">{letter}</DataType></CZ>")
    found = read(tmp_path, zipped({"main.xml": xml, "bindata/data.bin": height.astype(kind).tobytes()})).height_m
    assert np.argwhere(np.isnan(found)).tolist() == [[2, 7]]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])
def test_entities_are_refused_in_every_encoding(fails, encoding):
    """Nine nested texts, each ten times the one before: 3 GB."""
    declared = '<!ENTITY a "lol">' + "".join(
        f'<!ENTITY {name} "{10 * f"&{before};"}">' for before, name in zip("abcdefgh", "bcdefghi", strict=True)
    )
    mark = "\ufeff" if encoding.startswith("utf-16-") else ""
    name = "utf-16" if mark else encoding.removesuffix("-sig")
    xml = f'{mark}<?xml version="1.0" encoding="{name}"?><!DOCTYPE p [{declared}]><p>&i;</p>'
    start = time.process_time()
    assert "declares entities" in fails("laughs.x3p", zipped({"main.xml": xml.encode(encoding)}))
    assert time.process_time() - start < 1


def test_a_main_xml_in_utf16_is_read(tmp_path):
    def change(xml):
        return xml.replace("UTF-8", "UTF-16").encode("utf-16")

    np.testing.assert_array_equal(read(tmp_path, with_xml(change)).height_m, TILTED)


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_other_packings_are_refused(fails, method):
    members = members_of(instruments.x3p(TILTED, PIXEL_M))
    assert "not by deflate" in fails("packed.x3p", zipped(members, method))


def test_a_damaged_lzma_stream_is_one_line(fails):
    whole = bytearray(zipped(members_of(instruments.x3p(TILTED, PIXEL_M)), zipfile.ZIP_LZMA))
    whole[60:200] = bytes(140)
    assert "; " in fails("lzma.x3p", bytes(whole))


@pytest.mark.parametrize("inner", ["<a>" * 100_000, "<a>" * 40 + "</a>" * 40])
def test_xml_that_nests_deep_is_refused(fails, inner):
    assert "nests too deep" in fails("deep.x3p", zipped({"main.xml": f"<p>{inner}</p>"}))


def test_xml_of_too_many_elements_is_refused(fails, monkeypatch):
    monkeypatch.setattr(x3p, "_ELEMENTS_MAX", 1000)
    assert "more than 1000 elements" in fails("long.x3p", with_xml(lambda xml: xml.replace(LINK, "<a/>" * 1000)))


def vast_x3p(path, side):
    rows, cols = TILTED.shape
    xml = members_of(instruments.x3p(TILTED, PIXEL_M))["main.xml"].decode()
    xml = xml.replace(f"SizeX>{cols}<", f"SizeX>{side}<").replace(f"SizeY>{rows}<", f"SizeY>{side}<")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", xml.replace(">D</DataType></CZ>", ">I</DataType></CZ>"))
        with archive.open("bindata/data.bin", "w") as member:
            for _ in range(side):
                member.write(bytes(2 * side))


def vast_npy(path, side):
    header = f"{{'descr': '|i1', 'fortran_order': False, 'shape': ({side}, {side}), }}".encode().ljust(117) + b"\n"
    path.write_bytes(b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header)
    os.truncate(path, path.stat().st_size + side**2)


def vast_nid(path, side):
    data = nid_bytes(TILTED, bits=8, points=side, lines=side, channels=NID_CHANNELS[1:2])
    path.write_bytes(data)
    os.truncate(path, path.stat().st_size + side**2)


@pytest.mark.parametrize("make", [vast_x3p, vast_npy, vast_nid])
def test_a_map_of_too_many_points_is_refused_before_it_is_held(tmp_path, make):
    """9500 x 9500 points, packed to 0.2 MB or in a sparse file."""
    path = tmp_path / f"vast.{make.__name__[5:]}"
    make(path, 9500)
    tracemalloc.start()
    with pytest.raises(GratingError, match="9500 x 9500 points are more than 89 million; crop or reduce the scan"):
        read_height_map(str(path), *((1.0, 1.0) if path.suffix == ".npy" else ()))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 16 << 20
