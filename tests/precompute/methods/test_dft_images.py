# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders' images: their file holds what the methods sum; and the verb `dft`."""

import json

import numpy as np
import OpenEXR
import pytest

from precompute.base import exr_reader
from precompute.base.exr_reader import open_picture
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.methods import dft_images
from precompute.methods.dft_images import pack, settings_for
from precompute.methods.dft_layout import Layout, read_layout, read_sound_layout
from precompute.methods.method_registry import METHODS, SHADER_METHODS
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, sinusoidal
from precompute.table import atlas
from precompute.table.atlas import HEADER_KEY, read_header, write_together

RELIEF = prepare(blazed(periods=2, rows=40))
SETTINGS = settings_for(coherence_length_m=5e-6)


def density_read_from(image, layout: Layout, u, v, w, lam) -> float:
    """One direction's density as a shader computes it: every texel of the image, weighted one by one."""
    z = 2 * np.pi * w / lam * layout.scale_m
    if layout.expansion == "taylor":
        coefficients = np.cumprod([1.0] + [-z / n for n in range(1, layout.terms)])
    else:
        turn = (np.arange(4096) + 0.5) * np.pi / 4096
        bessel = [np.mean(np.cos(n * turn - z * np.sin(turn))) for n in range(layout.terms)]
        coefficients = np.array(bessel) * np.where(np.arange(layout.terms) > 0, 2, 1)
    rows, columns = layout.tile_rows, layout.tile_columns
    total = 0
    for n, c in enumerate(coefficients):
        y, x = n // layout.columns * rows, n % layout.columns * columns
        total = total + c * (image[y : y + rows, x : x + columns, 0] + 1j * image[y : y + rows, x : x + columns, 1])
    out = 1.0
    axes = (
        (v / lam, layout.length_v_m, rows, layout.copies_v),
        (u / lam, layout.length_u_m, columns, layout.copies_u),
    )
    for q, length, count, copies in axes:
        distance = np.arange(count) - (q * length + count // 2)
        weight = (
            np.sinc(distance) if layout.method == "pq" else np.exp(-0.5 * (distance / length / layout.sigma_f) ** 2)
        )
        total = (weight * (np.abs(np.rint(distance + q * length) - np.rint(q * length)) <= layout.texels // 2)) @ total
        phase = np.pi * q * length
        out *= 1 if copies == 1 else (np.sin(copies * phase) / (copies * np.sin(phase))) ** 2
    return out * layout.power * abs(total) ** 2 / lam**2


@pytest.mark.parametrize("name", ["flss", "chebyshev", "pq"])
def test_the_image_holds_what_the_method_sums(name):
    method = METHODS[name](RELIEF, SETTINGS)
    image, layout = pack(method)
    rng = np.random.default_rng(0)
    u, v = rng.uniform(-0.5, 0.5, (2, 6))
    w, lam = rng.uniform(0.5, 1.8, 6), rng.uniform(400e-9, 700e-9, 6)
    expected = method.density(u, v, w, wavelength_m=lam)
    got = [density_read_from(image, layout, *each) for each in zip(u, v, w, lam, strict=True)]
    peak = method.density(np.zeros(1), np.zeros(1), 0.0, wavelength_m=500e-9)[0]
    # Single precision on amplitudes: 6e-8 of the largest term of about 10 (z = 4).
    assert np.abs(np.sqrt(got) - np.sqrt(expected)).max() <= 1e-5 * np.sqrt(peak)


def test_the_bottom_row_alone_is_marked():
    image, layout = pack(METHODS["flss"](RELIEF, SETTINGS))
    assert image.shape == (layout.height, layout.width, 3)
    assert image.dtype == np.float32
    assert (image[0, :, 2] == 1).all()
    assert not image[1:, :, 2].any()


@pytest.mark.parametrize("name", SHADER_METHODS)
def test_the_verb_writes_one_file_that_comes_back(tmp_path, name, capsys):
    arguments = ["dft", "sample:blazed", "-o", str(tmp_path), "--method", name, "--terms", "2", "--json", "-"]
    assert parser.main([*arguments, "--progress", "none"]) == 0
    facts = json.loads(capsys.readouterr().out)
    [path] = tmp_path.iterdir()
    assert facts["files"] == [str(path)]
    layout = read_layout(path)
    assert (layout.method, layout.terms) == (name, 2)
    assert (layout.period_m > 0) == name.startswith("nmm")
    assert (layout.copies_u > 1) == (name == "pq")
    picture = open_picture(path)
    image = picture.pixels()
    assert image.dtype == np.float32
    term = image[: layout.tile_rows, -layout.tile_columns :]
    extrema = json.loads(picture.texts[HEADER_KEY])["extrema"]
    assert extrema[1] == [float(f) for c in (0, 1) for f in (term[..., c].min(), term[..., c].max())]


@pytest.mark.night("test_the_verb_writes_one_file_that_comes_back")
def test_the_verb_levels_as_it_is_asked(tmp_path):
    pictures = []
    for level in ("plane", "poly:4"):
        arguments = ["dft", "sample:elaphe", "-o", str(tmp_path / level), "--terms", "2", "--level", level]
        assert parser.main([*arguments, "--progress", "none"]) == 0
        [path] = (tmp_path / level).iterdir()
        pictures.append(open_picture(path).pixels())
    assert pictures[0].shape != pictures[1].shape or not np.allclose(*pictures)


def test_a_relief_too_deep_is_refused_with_its_name(tmp_path):
    deep = sinusoidal(2.5e-6, 3000e-9, periods=2, rows=8)
    with pytest.raises(GratingError, match=r"sample.*3000 nm of relief cannot converge.*chebyshev"):
        dft_images.images_to_folder(deep, "flss", SETTINGS, folder=tmp_path)
    assert not list(tmp_path.iterdir())


def test_other_files_are_no_images(tmp_path):
    with pytest.raises(GratingError, match="no such file"):
        read_layout(tmp_path / "none.exr")
    path = tmp_path / "bake.exr"
    image, layout = pack(METHODS["flss"](RELIEF, SETTINGS))
    write_together({path: (image, layout)}, {})
    assert read_layout(path) == layout
    with pytest.raises(GratingError, match="bake"):
        read_header(path)


@pytest.mark.parametrize("lie", [
    {"terms": 20_000}, {"terms": 0}, {"terms": True}, {"method": "gem"}, {"method": 'flss"\n'}, {"expansion": "sine"},
    {"illuminant": "moon"}, {"tile_rows": 7}, {"columns": 10**9}, {"texels": 10**6}, {"texels": 3.0}, {"copies_u": 0},
    {"copies_v": 10**12}, {"step_m": 1e-12}, {"step_m": 1.0}, {"length_u_m": 0}, {"length_v_m": 1e300},
    {"scale_m": float("nan")}, {"power": -1.0}, {"sigma_f": float("inf")}, {"period_m": "1"}, {"period_m": -1e-6},
])  # fmt: skip
def test_a_layout_that_lies_is_refused(tmp_path, lie):
    image, layout = pack(METHODS["flss"](RELIEF, SETTINGS))
    path = tmp_path / "lie.exr"
    record = {"format": atlas.FORMAT, "layout": {**vars(layout), **lie}}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, HEADER_KEY: json.dumps(record)}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(image[::-1])}) as file:
        file.write(str(path))
    with pytest.raises(GratingError, match=f"^{path}: .*; "):
        read_layout(path)


def test_an_image_that_is_no_number_is_refused(tmp_path):
    image, layout = pack(METHODS["flss"](RELIEF, SETTINGS))
    image[3, 3, 0] = np.nan
    write_together({tmp_path / "nan.exr": (image, layout)}, {})
    with pytest.raises(GratingError, match="not numbers"):
        read_sound_layout(tmp_path / "nan.exr")


def test_no_more_texels_are_written_than_are_read(monkeypatch):
    monkeypatch.setattr(exr_reader, "TEXELS_MAX", 1000)
    with pytest.raises(GratingError, match="lower --terms, or crop the scan"):
        pack(METHODS["flss"](RELIEF, SETTINGS))


def test_texels_follow_the_window():
    """A patch as long as its coherence takes 5; one three times as long has a window three times as wide in bins."""
    long = settings_for(coherence_length_m=RELIEF.size_m[1])
    short = settings_for(coherence_length_m=RELIEF.size_m[1] / 3)
    assert dft_images.texels_for(RELIEF, long) == 5
    assert dft_images.texels_for(RELIEF, short) == 15


def test_the_verb_chooses_texels(tmp_path):
    command = ["dft", "sample:blazed", "-o", str(tmp_path), "--texels", "0", "--terms", "3", "--progress", "none"]
    assert parser.main(command) == 0
    assert read_layout(tmp_path / "blazed_flss.exr").texels == 5
