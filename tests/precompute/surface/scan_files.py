# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of one known surface in every format, made in memory."""

import numpy as np
from gwyfile.objects import GwyContainer, GwyDataField
from PIL import Image

from precompute.surface.readers.reader_registry import read_height_map

# The surface of all formats: a blazed grating whose grating vector is turned by 20 degrees from T towards B, which
# looks different after any flip, turn or transpose. Rows run along -B.
ROWS, COLS = 24, 40
PIXEL_M = 25e-9
SIZE_UM = COLS * PIXEL_M * 1e6
HEIGHT_NM = 200.0
Y, X = -np.arange(ROWS)[:, None] * PIXEL_M, np.arange(COLS) * PIXEL_M
TILTED = 200e-9 * (((X * np.cos(np.radians(20)) + Y * np.sin(np.radians(20))) / 310e-9) % 1)
GREY16 = np.round(TILTED / 200e-9 * 65535).astype(np.uint16)
GREY8 = np.round(TILTED / 200e-9 * 255).astype(np.uint8)
HALF_STEP_16, HALF_STEP_8 = 100e-9 / 65535, 100e-9 / 255

NID_CHANNELS = (
    ("Amplitude", "V", "Scan forward"),
    ("Z-Axis", "m", "Scan forward"),
    ("Z-Axis", "m", "Scan backward"),
)


def nid_bytes(
    height_m, bits=32, signed=True, points=None, lines=None, channels=NID_CHANNELS, backward=None, pixel_m=PIXEL_M
):
    """A .nid file with the heights in the forward Z-Axis, `backward` or the negated heights in the backward one, and
    zeros in other channels."""
    backward = -height_m if backward is None else backward
    rows, cols = height_m.shape
    header = ["[DataSet]", "Version=2", "GroupCount=2", "Gr0-Count=8", "Gr1-Count=8"]
    header += [f"Gr{int('back' in frame)}-Ch{i}=DataSet-{i}" for i, (_, _, frame) in enumerate(channels)]
    blocks = []
    for i, (name, unit, frame) in enumerate(channels):
        header += [
            "",
            f"[DataSet-{i}]",
            f"Points={points or cols} ",
            f"Lines={lines or rows}",
            f"Frame={frame}",
            "Dim0Unit=m",
            f"Dim0Range={cols * pixel_m!r}",
            "Dim1Unit=m",
            f"Dim1Range={rows * pixel_m!r}",
            f"Dim2Name={name}",
            f"Dim2Unit={unit}",
            "Dim2Range=8e-07",
            "Dim2Min=-4e-07",
            "SaveMode=Binary",
            f"SaveBits={bits}",
            f"SaveSign={'Signed' if signed else 'Unsigned'}",
            "SaveOrder=Intel",
        ]
        value = {"Scan forward": height_m, "Scan backward": backward}[frame] if unit == "m" else 0 * height_m
        fraction = value / 8e-7 if signed else value / 8e-7 + 0.5
        kind = f"<{'i' if signed else 'u'}{bits // 8}"
        blocks.append(np.round(fraction[::-1] * 2**bits).astype(kind).tobytes())
    return "\r\n".join([*header, "", "#!"]).encode() + b"".join(blocks)


def gwy_bytes(fields):
    """A .gwy file of {key: array or value}; an array becomes a field of heights in metres with pixels of PIXEL_M."""
    container = GwyContainer()
    for key, value in fields.items():
        if isinstance(value, np.ndarray):
            rows, cols = value.shape
            value = GwyDataField(value, cols * PIXEL_M, rows * PIXEL_M, si_unit_xy="m", si_unit_z="m")
        container[key] = value
    return b"GWYP" + container.serialize()


def picture(path, array, **options):
    """Save an array as a picture; return the path as a string."""
    Image.fromarray(array).save(path, **options)
    return str(path)


def read_picture(path, **options):
    """Read a picture with the size and height of TILTED, unless `options` replace them."""
    return read_height_map(str(path), **{"size_um": SIZE_UM, "height_nm": HEIGHT_NM} | options)
