# SPDX-License-Identifier: GPL-3.0-or-later
"""Valid files of every instrument's format, all with the same heights and with the extra channels that real files have.

Each function takes heights (rows, cols) in metres, row 0 at the scan's top, within -400 nm to 400 nm, and the pixel's
side in metres. Backward channels hold the negated heights; channels that are not heights hold column numbers."""

import io
import struct
import zipfile
import zlib

import numpy as np

# The range of heights that the stored integers cover.
SPAN_M = 800e-9


def _columns(height: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.arange(height.shape[1], dtype=float), height.shape)


def nanoscope(height: np.ndarray, pixel_m: float, *, stored: str = "<i2", declared: int = 2) -> bytes:
    """A NanoScope file with the sensor's height forward and backward, and a phase."""
    rows, cols = height.shape
    bits = 8 * declared
    steps = np.round(height / SPAN_M * 2.0**bits)
    channels = (
        ("ZSensor", "Trace", "V [Sens. ZsensSens] (0.0001 V/LSB) 2 V", steps),
        ("Height", "Retrace", "V [Sens. Zsens] (0.0001 V/LSB) 8 V", -steps),
        ("Phase", "Trace", "V [Sens. Phase] (0.005 \xba/LSB) 360 \xba", _columns(height)),
    )
    lists = ["\\*File list", "\\Version: 0x09010201", "\\Start context: OL2BIG", "\\*Scanner list"]
    lists += ["\\@Sens. Zsens: V 100.0000 nm/V", "\\*Ciao scan list", "\\@Sens. ZsensSens: V 400.0000 nm/V"]
    lists += ["\\@Sens. Phase: V 1.000000 "]
    size = rows * cols * np.dtype(stored).itemsize
    for number, (name, direction, scale, _) in enumerate(channels):
        lists += ["\\*Ciao image list", f"\\Data offset: {4096 + number * size}", f"\\Data length: {size}"]
        lists += [f"\\Bytes/pixel: {declared}", f"\\Samps/line: {cols}", f"\\Number of lines: {rows}"]
        lists += [f"\\Scan Size: {cols * pixel_m * 1e6!r} {rows * pixel_m * 1e6!r} ~m"]
        lists += [f"\\Line Direction: {direction}", f'\\@2:Image Data: S [{name}] "{name}"', f"\\@2:Z scale: {scale}"]
    header = "\r\n".join([*lists, "\\*File list end", ""]).encode("latin-1").ljust(4096, b"\0")
    return header + b"".join(values[::-1].astype(stored).tobytes() for *_, values in channels)


def nanoscope_5(height: np.ndarray, pixel_m: float) -> bytes:
    """The NanoScope file with the keys of version 5, and its phase in an unknown unit."""
    whole = nanoscope(height, pixel_m)
    for key in (b"Start context", b"Scan Size", b"Line Direction"):
        whole = whole.replace(key, key.capitalize())
    return whole.replace(b"[Sens. Phase] (0.005 \xba/LSB) 360 \xba", b"(0.1 log(Arb)/LSB) 32.0 log(Arb)".ljust(33))


def ibw(height: np.ndarray, pixel_m: float, *, order: str = "<", labels: tuple[str, ...] | None = None) -> bytes:
    """An Igor wave of Asylum Research with heights forward and backward, and a phase."""
    rows, cols = height.shape
    labels = ("HeightTrace", "HeightRetrace", "PhaseTrace") if labels is None else labels
    layers = (height, -height, _columns(height))
    data = b"".join(layer[::-1].astype(f"{order}f4").tobytes() for layer in layers)
    note, named = b"ScanSize: 1e-06\r", b"".join(label.encode().ljust(32, b"\0") for label in ("", *labels))
    wave = bytearray(320)
    struct.pack_into(f"{order}ih", wave, 12, height.size * len(layers), 2)
    struct.pack_into(f"{order}4i2d", wave, 68, cols, rows, len(layers), 0, pixel_m, pixel_m)
    wave[148:149] = wave[152:153] = wave[156:157] = b"m"
    sizes = (320 + len(data), 0, len(note), 0, 0, 0, 0, 0, 0, 0, len(named), 0, 0, 0, 0)
    head = struct.pack(f"{order}hH15i", 5, 0, *sizes)[:64]
    total = sum(struct.unpack(f"{order}192h", head + bytes(wave)))
    head = head[:2] + struct.pack(f"{order}H", -total & 0xFFFF) + head[4:]
    return head + bytes(wave) + data + note + named


def tiff(pages: list[dict[int, object]], order: str = ">", *, first: int = 8) -> bytes:
    """A TIFF from pages of tags (integers, lists of integers, floats, texts, bytes); the first page is at `first`."""
    out = bytearray((b"MM\0*" if order == ">" else b"II*\0") + struct.pack(f"{order}I", first)).ljust(first, b"\0")
    for number, page in enumerate(pages):
        entries, beyond = b"", bytearray()
        after = len(out) + 2 + 12 * len(page) + 4
        for tag, value in sorted(page.items()):
            kind, count, data = _tiff_value(value, order)
            if len(data) > 4:
                place = struct.pack(f"{order}I", after + len(beyond))
                beyond += data
            else:
                place = data.ljust(4, b"\0")
            entries += struct.pack(f"{order}HHI", tag, kind, count) + place
        following = 0 if number == len(pages) - 1 else after + len(beyond)
        out += struct.pack(f"{order}H", len(page)) + entries + struct.pack(f"{order}I", following) + beyond
    return bytes(out)


def _tiff_value(value: object, order: str) -> tuple[int, int, bytes]:
    if isinstance(value, str):
        return 2, len(value) + 1, value.encode() + b"\0"
    if isinstance(value, bytes):
        return 7, len(value), value
    if isinstance(value, float):
        return 12, 1, struct.pack(f"{order}d", value)
    numbers = value if isinstance(value, list) else [value]
    return 4, len(numbers), struct.pack(f"{order}{len(numbers)}I", *numbers)


def jpk(height: np.ndarray, pixel_m: float) -> bytes:
    """A JPK image with the height forward and backward, and an amplitude that is also in metres."""
    rows, cols = height.shape
    factor, offset = SPAN_M / 2**32, 100e-9
    first = {256: 1, 257: 1, 258: 8, 32768: "2.0", 32834: cols * pixel_m, 32835: rows * pixel_m, 32837: 0}
    maps = (("Height", 1, -height), ("Height", 0, height), ("Lock-In Amplitude", 0, height))
    pages: list[dict[int, object]] = [first]
    for name, retrace, values in maps:
        steps = np.round((values - offset) / factor)[::-1].astype(">i4").tobytes()
        half = rows // 2 * cols * 4
        page = {256: cols, 257: rows, 258: 32, 259: 1, 262: 1, 273: [0, half], 277: 1, 278: rows // 2, 339: 2}
        page |= {279: [half, len(steps) - half], 32848: name.lower(), 32849: retrace, 32850: name, 32896: 2}
        page |= {32897: "nominal", 32912: "raw", 32931: "NullScaling", 32960: "nominal", 32978: "m"}
        page |= {32979: "LinearScaling", 32980: factor, 32981: offset, 50000: steps}
        pages.append(page)
    # The strips are the bytes of the last tag; their offset is known once the file is made.
    whole = tiff(pages)
    for page in pages[1:]:
        at = whole.index(page[50000], page[273][0])
        half = page[279][0]
        page[273] = [at, at + half]
        whole = tiff(pages)
    return whole


def park(height: np.ndarray, pixel_m: float, *, version: int = 2, first: int = 8) -> bytes:
    """A Park TIFF; its visible page is black and begins at `first`."""
    rows, cols = height.shape
    kind = "<f4" if version == 2 else "<i2"
    gain, scale, offset = (-2.0, 0.5e-6 * 1e6, 0.25) if version == 2 else (SPAN_M / 2**16 * 1e6, 1.0, 0.0)
    values = (height * 1e6 / gain - offset) / scale
    values = values if version == 2 else np.round(values)
    header = bytearray(284 if version == 1 else 356)
    header[4:20] = "Z Height".encode("utf-16-le")
    struct.pack_into("<2I", header, 100, cols, rows)
    struct.pack_into("<I", header, 128, 1)
    struct.pack_into("<2d", header, 140, cols * pixel_m * 1e6, rows * pixel_m * 1e6)
    struct.pack_into("<3d", header, 220, gain, scale, offset)
    header[244:248] = "um".encode("utf-16-le")
    if version == 2:
        struct.pack_into("<I", header, 348, 2)
    page = {
        256: 1,
        257: 1,
        258: 8,
        259: 1,
        262: 1,
        273: 8,
        277: 1,
        278: 1,
        279: 1,
        50432: 235082497,
        50433: 0x01000000 + version,
    }
    return tiff([page | {50434: values[::-1].astype(kind).tobytes(), 50435: bytes(header)}], "<", first=first)


def wsxm(height: np.ndarray, pixel_m: float, *, kind: str = "short") -> bytes:
    rows, cols = height.shape
    relief = float(np.ptp(height))
    values = np.round(height / relief * 60000) if kind == "short" else height * 1e9
    lines = ["[Control]", "", f"    X Amplitude: {cols * pixel_m * 1e9!r} nm"]
    lines += [f"    Y Amplitude: {rows * pixel_m * 1e10!r} \xc5", "", "[General Info]", ""]
    lines += ["    Acquisition channel: Topography", f"    Image Data Type: {kind}", f"    Number of columns: {cols}"]
    lines += [f"    Number of rows: {rows}", "    X scanning direction: Forward"]
    lines += [f"    Z Amplitude: {relief * 1e9!r} nm", "", "[Header end]", ""]
    body = "\r\n".join(lines)
    beginning = "WSxM file copyright UAM\r\nSxM Image file\r\nImage header size: {:5}\r\n\r\n"
    header = (beginning.format(len(beginning) - 1 + len(body)) + body).encode("latin-1")
    data = values[::-1, ::-1].astype("<f8" if kind == "double" else "<i2")
    return beginning.format(len(header)).encode() + body.encode("latin-1") + data.tobytes()


def agilent(height: np.ndarray, pixel_m: float) -> bytes:
    """An Agilent image with the height forward and backward, and a deflection."""
    rows, cols = height.shape
    lines = [("fileType", "Image"), ("xPixels", cols), ("yPixels", rows)]
    lines += [("xLength", repr(cols * pixel_m)), ("yLength", repr(rows * pixel_m))]
    steps = np.round(height / SPAN_M * 2.0**32)
    blocks = b""
    channels = (("Deflection", "Trace", "V"), ("Topography", "Retrace", "um"), ("Topography", "Trace", "um"))
    for (name, direction, unit), values in zip(channels, (_columns(height), -steps, steps), strict=True):
        lines += [("bufferLabel", name), ("direction", direction), ("bufferUnit", unit)]
        lines += [("bufferRange", repr(SPAN_M / 2 * 1e6))]
        blocks += values[::-1].astype("<i4").tobytes()
    header = "".join(f"{key:14}{value}\n" for key, value in lines)
    return header.encode() + b"data          BINARY_32\n" + blocks


def gsf(height: np.ndarray, pixel_m: float, *, across: float = 1.0) -> bytes:
    """A Gwyddion Simple Field: heights in nm, sides in micrometres, and pixels `across` times as wide as high."""
    rows, cols = height.shape
    lines = [
        "Gwyddion Simple Field 1.0",
        f"XRes = {cols}",
        f"YRes = {rows}",
        f"XReal = {across * cols * pixel_m * 1e6!r}",
    ]
    lines += [f"YReal = {rows * pixel_m * 1e6!r}", "XYUnits = um", "ZUnits = nm", "Title = Topography", ""]
    header = "\n".join(lines).encode()
    return header + bytes(4 - len(header) % 4) + (height * 1e9).astype("<f4").tobytes()


def gwyddion_text(height: np.ndarray, pixel_m: float, *, german: bool = False) -> bytes:
    """Gwyddion's text export; the German one has decimal commas."""
    rows, cols = height.shape
    names = ("Kanal", "Breite", "H\xf6he", "Werteinheiten") if german else ("Channel", "Width", "Height", "Value units")
    values = ("Topography", f"{cols * pixel_m * 1e6!r} \xb5m", f"{rows * pixel_m * 1e6!r} \xb5m", "m")
    lines = [f"# {name}: {value}" for name, value in zip(names, values, strict=True)]
    lines += ["\t".join(f"{value:.12e}" for value in row) for row in height]
    text = "\n".join(lines) + "\n"
    return (text.replace(".", ",") if german else text).encode()


def digital_surf(height: np.ndarray, pixel_m: float, *, packed: bool = False, bits: int = 32) -> bytes:
    """A Digital Surf studiable, lengths in nanometres; NaN marks missing points."""
    rows, cols = height.shape
    step = np.float32(SPAN_M / 2 ** min(bits, 31) * 1e9)
    lowest, highest = -(2 ** (min(bits, 31) - 1)) + 10, 2 ** (min(bits, 31) - 1)
    steps = np.where(np.isnan(height), lowest - 2, np.round(np.nan_to_num(height) * 1e9 / np.float64(step)))
    stored = steps.astype(f"<i{bits // 8}").tobytes()
    header = bytearray(512)
    header[:12] = b"DSCOMPRESSED" if packed else b"DIGITAL SURF"
    struct.pack_into("<4H", header, 12, 1, 1, 2, 2)
    struct.pack_into("<H", header, 86, 1)
    struct.pack_into("<H4iI3f", header, 98, bits, lowest, highest, cols, rows, height.size, *2 * [pixel_m * 1e9], step)
    for at, text in ((132, "X"), (148, "Y"), (164, "Z"), (180, "nm"), (196, "nm"), (212, "nm")):
        header[at : at + 16] = text.encode().ljust(16)
    struct.pack_into("<2H", header, 334, 7, 0)
    if packed:
        half = len(stored) // 2
        streams = [zlib.compress(part) for part in (stored[:half], stored[half:])]
        lengths = (half, len(streams[0]), len(stored) - half, len(streams[1]))
        stored = struct.pack("<5I", 2, *lengths) + b"".join(streams)
    return bytes(header) + b"comment" + stored


def sdf(height: np.ndarray, pixel_m: float, *, text: bool = False) -> bytes:
    """Surface data of ISO 25178 (SDF) in nanometres; missing points are BAD in the text form."""
    rows, cols = height.shape
    if text:
        lines = ["aISO-1.0", "ManufacID = test", f"NumPoints = {cols}", f"NumProfiles = {rows}"]
        lines += [f"Xscale = {pixel_m!r}", f"Yscale = {pixel_m!r}", "Zscale = 1e-9", "Zresolution = 1e-12"]
        lines += ["Compression = 0", "DataType = 7", "CheckType = 0", "*"]
        lines += [" ".join(f"{value:.10g}".replace("nan", "BAD") for value in row) for row in height * 1e9]
        return "\n".join([*lines, "*", "< PartName > test < / PartName >", "*"]).encode()
    head = struct.pack("<8s10s12s12s2H4d3B", b"bISO-1.0", b"", b"", b"", cols, rows, pixel_m, pixel_m, 1e-9, 0, 0, 7, 0)
    return head + (height * 1e9).astype("<f8").tobytes()


def x3p(height: np.ndarray, pixel_m: float, *, packed: bool = True, folder: str = "", kind: str = "D") -> bytes:
    """An X3P; `kind` "L" stores picometres and a mask of valid points."""
    rows, cols = height.shape
    extra, link, members = "", "", {}
    if kind == "L":
        extra = "<Increment>1e-12</Increment><Offset>0</Offset>"
        link = "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>"
        valid = np.packbits(~np.isnan(height).ravel(), bitorder="little").tobytes()
        members = {"bindata/valid.bin": valid, "bindata/data.bin": np.round(np.nan_to_num(height) * 1e12).astype("<i4")}
    else:
        members = {"bindata/data.bin": height.astype("<f8")}
    axis = f"<AxisType>I</AxisType><DataType>D</DataType><Increment>{pixel_m!r}</Increment><Offset>0</Offset>"
    xml = f"""<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1><Revision>ISO5436 - 2000</Revision>
<FeatureType>SUR</FeatureType><Axes><CX>{axis}</CX><CY>{axis}</CY>
<CZ><AxisType>A</AxisType><DataType>{kind}</DataType>{extra}</CZ></Axes></Record1>
<Record3><MatrixDimension><SizeX>{cols}</SizeX><SizeY>{rows}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink>{link}</DataLink></Record3></p:ISO5436_2>"""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED) as archive:
        for name, data in ({"main.xml": xml.encode()} | members).items():
            archive.writestr(folder + name, bytes(data))
    return out.getvalue()


def x3p_listed(height: np.ndarray, pixel_m: float) -> bytes:
    """An X3P whose points are listed in main.xml, which is in UTF-16; the archive holds no other file."""
    with zipfile.ZipFile(io.BytesIO(x3p(height, pixel_m))) as archive:
        xml = archive.read("main.xml").decode()
    points = "".join("<Datum/>" if z != z else f"<Datum>{z!r}</Datum>" for z in map(float, height.ravel()))
    head, tail = xml.split("<DataLink>")[0], xml.split("</DataLink>")[1]
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        listed = f"{head}<DataList>{points}</DataList>{tail}".replace("UTF-8", "UTF-16")
        archive.writestr("main.xml", listed.encode("utf-16"))
    return out.getvalue()


def xyz(height: np.ndarray, pixel_m: float) -> bytes:
    """Points of a grid, z in nanometres, x and y in micrometres; y points up."""
    rows, cols = height.shape
    step = pixel_m * 1e6
    points = [(x * step, (rows - 1 - y) * step, height[y, x] * 1e9) for x in range(cols) for y in range(rows)]
    return "".join(f"{x:.6f} {y:.6f} {z:.9f}\n" for x, y, z in points if z == z).encode()


def matrix(height: np.ndarray, pixel_m: float) -> bytes:
    """A text matrix of the heights in nanometres."""
    return "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in height * 1e9).encode()


def exr(height: np.ndarray, pixel_m: float) -> bytes:
    """The heights in nanometres as floats of an uncompressed OpenEXR picture."""
    rows, cols = height.shape
    window = struct.pack("<4i", 0, 0, cols - 1, rows - 1)
    facts = (
        ("channels", "chlist", b"Y\0" + struct.pack("<4i", 2, 0, 1, 1) + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", bytes(8)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    )
    head = b"v/1\x01\2\0\0\0"
    for name, kind, value in facts:
        head += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    first = len(head) + 1 + 8 * rows
    places = struct.pack(f"<{rows}Q", *(first + row * (8 + 4 * cols) for row in range(rows)))
    lines = (struct.pack("<2i", row, 4 * cols) + (height[row] * 1e9).astype("<f4").tobytes() for row in range(rows))
    return head + b"\0" + places + b"".join(lines)


def npy(height: np.ndarray, pixel_m: float) -> bytes:
    """The heights in nanometres as a NumPy file."""
    out = io.BytesIO()
    np.save(out, height * 1e9)
    return out.getvalue()
