# SPDX-License-Identifier: GPL-3.0-or-later
"""Valid files that hold no map, or whose format is not read: the error says what they are and what to do."""

import io
import struct
import zipfile

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.readers.scan_file import CONVERT
from tests.hostile import instruments
from tests.precompute.surface.scan_files import GREY8, PIXEL_M, SIZE_UM, TILTED, picture, read_picture


def zipped(*names):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in names:
            archive.writestr(name, b"something")
    return out.getvalue()


def igor_wave(version, order):
    head = bytearray({1: 118, 2: 126, 3: 130}[version])
    struct.pack_into(f"{order}h", head, 0, version)
    struct.pack_into(f"{order}i", head, 2, 1234)
    struct.pack_into(f"{order}H", head, len(head) - 2, -sum(struct.unpack(f"{order}{len(head) // 2}h", head)) & 0xFFFF)
    return bytes(head) + bytes(400)


# A matrix under its x axis and beside its y axis, with an empty corner.
AXES = "\n".join(
    ",".join(row)
    for row in (
        ["", *(f"{0.2 * col:.1f}" for col in range(12))],
        *([f"{0.1 * row:.1f}", *(str(height) for height in heights[:12])] for row, heights in enumerate(GREY8[:9])),
    )
).encode()


@pytest.mark.parametrize(
    "name, data, told",
    [
        ("surface.dat", b"\x88\x1b\x03\x70" + bytes(5000), f"a Zygo MetroPro file, which is not read here; {CONVERT}"),
        ("surface.vk4", b"VK4_" + bytes(500), f"a Keyence VK4 file, which is not read here; {CONVERT}"),
        ("scan.sm4", b"\xa0\0" + "STiMage 005.0".encode("utf-16-le") + bytes(900), "an RHK file"),
        ("curves.jpk-force", zipped("header.properties", "segments/0/segment-header.properties"), "without an image"),
        ("table.xlsx", zipped("[Content_Types].xml", "xl/workbook.xml"), "an Office document; export the sheet"),
        ("table.csv", zipped("[Content_Types].xml", "xl/workbook.xml"), "an Office document; export the sheet"),
        ("surface.plux", zipped("LAYER_0.raw", "index.xml"), f"as Sensofar's .plux; {CONVERT}"),
        ("table.ods", zipped("mimetype", "content.xml"), "an OpenDocument file"),
        ("arrays.npz", zipped("height.npy"), "an archive of NumPy arrays; save one array as .npy"),
        ("other.zip", zipped("a.txt"), f"a zip archive without main.xml, so not an X3P file; {CONVERT}"),
        ("other.x3p", zipped("a.txt"), f"a zip archive without main.xml, so not an X3P file; {CONVERT}"),
        ("curve.ibw", igor_wave(2, "<"), "an Igor wave of version 2, which holds one curve; "),
        ("curve.ibw", igor_wave(3, ">"), "an Igor wave of version 3, which holds one curve; "),
        ("skin.jpg", b"\xff\xd8\xff\xe0" + bytes(500), "a JPEG picture, which is not read here; its compression"),
        ("skin.png", b"\xff\xd8\xff\xe0" + bytes(500), "a JPEG picture"),
        ("profile.txt", b"Width(um) Height(nm)\n" + b"0.1 2.5\n" * 900, "a text of 2 columns under a heading, such as"),
        ("table.csv", b"x;y;z\n" + b"1,5;2,5;3,5\n" * 9, "a text of 3 columns under a heading; put a # before each"),
        ("map.asc", b"Size\t3\n" + b"1 2 3\n" * 9 + b"Bad 2 3\n" * 2,
         "'Bad' is not a number; write nan for points that were not measured, and put a # before each"),
        ("map.xyz", b"0 0 1\n" * 9 + b"0 0 No Data\n" * 2, "'No Data' is not a number; write nan for"),
        ("late.csv", b"1,2,3,4\n" * 900 + b"1,x,3,4\n", "'x' is not a number; write nan for"),
        ("uneven.csv", b"1,2,3,4\n" * 900 + b"1,2\n", "row 901 has 2 numbers, and row 1 has 4; give each row the same"),
        ("axes.csv", AXES, "its first row and column are axes, no heights; delete the first row and the first column"),
        ("corner.csv", b"0" + AXES, "its first row and column are axes, no heights; delete the first row"),
        ("scan.dat", b"[Paramco32]\r\n" + bytes(500), f"a Createc file, which is not read here; {CONVERT}"),
        ("scan.opdx", b"VCA DATA\1\0\0\x55" + bytes(500), f"a Dektak .opdx file, which is not read here; {CONVERT}"),
        ("notes.txt", b"something else\n" * 30, f"misnamed or of another program; export it again, or {CONVERT}"),
        ("scan.xyzw", b"\1\2\3\4" * 300, f"not a format that is read here; {CONVERT}, or export it as one of .nid"),
    ],
)  # fmt: skip
def test_what_a_file_is_and_how_to_convert_it(fails, name, data, told):
    sizes = {"size_um": 1, "height_nm": 1} if name in ("late.csv", "uneven.csv", "axes.csv", "corner.csv") else {}
    assert told in fails(name, data, **sizes)


@pytest.mark.parametrize("name", ["nanoscope", "jpk", "agilent", "sdf"])
def test_a_damaged_file_may_be_converted_too(fails, name):
    """The reader cannot tell damage from an unknown version, which Gwyddion may read."""
    extension = {"nanoscope": ".spm", "agilent": ".mi"}.get(name, f".{name}")
    whole = getattr(instruments, name)(TILTED, PIXEL_M)
    assert fails(f"half{extension}", whole[: len(whole) // 2]).endswith(f"; copy it again, or {CONVERT}")


def test_a_table_with_its_heading_marked_is_read(tmp_path):
    """Also with its numbers in quotes."""
    path = tmp_path / "marked.txt"
    path.write_bytes(b"# Heights in nm\n" + instruments.matrix(TILTED, PIXEL_M))
    heights = read_height_map(str(path), SIZE_UM, 1.0).height_m
    quoted = "\n".join(",".join(f'"{value:.17g}"' for value in row) for row in heights * 1e9)
    path.write_text(f"# Heights in nm\n{quoted}\n")
    np.testing.assert_allclose(read_height_map(str(path), SIZE_UM, 1.0).height_m, heights, rtol=1e-12)


@pytest.mark.parametrize("shape", [(1, 512), (512, 1), (2, 512), (512, 2), (7, 512), (512, 7), (7, 7), (1, 1)])
def test_profiles_are_no_maps(tmp_path, shape):
    height = np.random.default_rng(1).random(shape) * 1e-7
    np.save(tmp_path / "few.npy", height)
    (tmp_path / "few.gsf").write_bytes(instruments.gsf(height, PIXEL_M))
    (tmp_path / "few.sdf").write_bytes(instruments.sdf(height, PIXEL_M))
    (tmp_path / "few.x3p").write_bytes(instruments.x3p(height, PIXEL_M))
    (tmp_path / "few.sur").write_bytes(instruments.digital_surf(height, PIXEL_M))
    (tmp_path / "few.txt").write_bytes(instruments.matrix(height, PIXEL_M))
    told = f"{shape[0]} x {shape[1]} points are a profile or a part of a scan, not a map; give a scan of at least 8"
    for extension in ("npy", "gsf", "sdf", "x3p", "sur", "txt"):
        sizes = (1.0, 100.0) if extension in ("npy", "txt") else ()
        with pytest.raises(GratingError, match=f"few.{extension}: {told}"):
            read_height_map(str(tmp_path / f"few.{extension}"), *sizes)
    with pytest.raises(GratingError, match=told):
        read_picture(picture(tmp_path / "few.png", np.resize(GREY8, shape)))


def test_eight_rows_and_columns_are_a_map(tmp_path):
    np.save(tmp_path / "least.npy", TILTED[:8, :8])
    assert read_height_map(str(tmp_path / "least.npy"), 1.0, 1e9).rows == 8
