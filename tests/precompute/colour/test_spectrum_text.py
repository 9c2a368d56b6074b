# SPDX-License-Identifier: GPL-3.0-or-later
"""Files with the spectrum of a lamp, and their canonical texts."""

import os

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.colour.illuminants import (
    LARGEST_BYTES,
    MOST_POINTS,
    illuminant_of,
    is_illuminant,
    read_spectrum,
    spectrum,
)
from precompute.colour.observer import white_xyz


@pytest.mark.parametrize("content", [
    "400,1\n500,2\n600,4\n", "400 1\n500 2\n600 4", "400\t1\r\n500\t2\r\n600\t4\r\n", "400;1\n500;2\n600;4\n",
    "# a lamp\nnm, power\n400, 0.5  # dim\n\n500, 1\n600, 2\n", "\ufeff400 25\n500 50\n600 1e2\n",
])  # fmt: skip
def test_a_file_of_either_kind(tmp_path, content):
    path = tmp_path / "lamp.csv"
    path.write_bytes(content.encode())
    text = illuminant_of(str(path))
    assert text == "400:0.25 500:0.5 600:1"
    assert is_illuminant(text) and illuminant_of(text) == text
    nm, power = spectrum(text)
    np.testing.assert_array_equal(nm, [400, 500, 600])
    np.testing.assert_array_equal(power, [0.25, 0.5, 1])


def test_a_file_of_an_illuminant_is_the_illuminant(tmp_path):
    """To the text's five digits, from a file that reaches beyond what is seen."""
    nm, power = spectrum("FL11")
    rows = [(300, 0), *zip(nm, power, strict=True), (785, 1), (1000, 50)]
    path = tmp_path / "tube.txt"
    path.write_text("\n".join(f"{a} {b}" for a, b in rows))
    text = read_spectrum(path)
    assert text.startswith("380:") and " 780:" in text and "1000:" not in text
    np.testing.assert_allclose(white_xyz(text), white_xyz("FL11"), rtol=1e-5)


def test_a_spectrometer_s_file(tmp_path):
    """As many points as a text may hold, with small powers and odd wavelengths."""
    nm = np.linspace(380, 780, MOST_POINTS) + 1 / 3
    path = tmp_path / "lamp.csv"
    power = np.linspace(1e-9, 7, len(nm)) * 1e-300
    path.write_text("\n".join(f"{a:.12f},{b:.12g}" for a, b in zip(nm, power, strict=True)))
    text = read_spectrum(path)
    assert is_illuminant(text) and len(text) < 24 * MOST_POINTS


BAD = {
    "empty": (b"", "has 0 points"),
    "one point": (b"500 1", "has 1 points"),
    "only titles": (b"nm power\n", "has 0 points"),
    "negative": (b"400 1\n500 -1\n", "line 2: a negative power"),
    "nan": (b"400 1\n500 nan\n", "line 2: not a finite number"),
    "infinite": (b"400 inf\n500 1\n", "line 1: not a finite number"),
    "overflow": (b"400 1e999\n500 1\n", "line 1: not a finite number"),
    "descending": (b"500 1\n400 1\n", "line 2: the wavelengths do not ascend"),
    "twice": (b"400 1\n400 1\n500 1\n", "line 2: the wavelengths do not ascend"),
    "nearly twice": (b"400 1\n400.000000001 1\n500 1\n", "closer than"),
    "metres": (b"400e-9 1\n500e-9 1\n", "line 1: not a wavelength in nanometres"),
    "micrometres": (b"0.4 1\n0.5 1\n", "line 1: not a wavelength in nanometres"),
    "picometres": (b"400000 1\n500000 1\n", "line 1: not a wavelength in nanometres"),
    "infrared": (b"800 1\n900 1\n", "no light from 380 to 780 nm"),
    "ultraviolet": (b"200 1\n380 1\n", "no light from 380 to 780 nm"),
    "dark": (b"400 0\n500 0\n", "no light"),
    "dark where it is seen": (b"200 1\n379 0\n500 0\n", "no light"),
    "three columns": (b"400 1 2\n500 1 2\n", "line 1 has 3 columns"),
    "one column": (b"400\n500\n", "line 1 has 1 columns"),
    "decimal commas": (b"400,5 1,5\n500,5 2,5\n", "line 1 has 4 columns"),
    "words": (b"400 1\n500 bright\n", "line 2: bright is not a number"),
    "binary": (bytes(range(256)), "is not a text file"),
    "zeros": (b"400 1\0\n500 1\n", "is not a text file"),
    "utf-16": ("400 1\n500 1\n".encode("utf-16"), "is not a text file"),
    "large": (b"#" * (LARGEST_BYTES + 1), "is larger than 1 MiB"),
    "many points": ("".join(f"{400 + k / 100} 1\n" for k in range(3000)).encode(), "has 3000 points"),
}


@pytest.mark.parametrize("kind", BAD)
def test_files_that_are_no_spectra(tmp_path, kind):
    content, told = BAD[kind]
    path = tmp_path / "lamp.csv"
    path.write_bytes(content)
    with pytest.raises(GratingError) as error:
        illuminant_of(str(path))
    line = str(error.value)
    assert line.startswith(f"{path}: ") and told in line and "; " in line and "\n" not in line


def test_what_is_no_file(tmp_path):
    for name, told in (("", "is not a file"), ("none.csv", "No such file"), ("a\0b", "cannot")):
        path = tmp_path / name
        with pytest.raises(GratingError, match=told):
            illuminant_of(str(path))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "lamp.csv")
    with pytest.raises(GratingError, match="is not a file"):
        read_spectrum(tmp_path / "lamp.csv")
