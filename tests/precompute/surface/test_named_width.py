# SPDX-License-Identifier: GPL-3.0-or-later
"""The width in a file's name, and the names that say none."""

import pytest

from precompute.surface.readers.pictures import named_width_um


@pytest.mark.parametrize(
    ("name", "um"),
    [
        ("skin_10um.png", 10),
        ("AFM 2.5 um x.tif", 2.5),
        ("grid-500nm-02.png", 0.5),
        ("/data/20nm/elaphe_65um.png", 65),
        ("65um.bmp", 65),
        ("2,5um.png", 2.5),
        ("scan 30 \u00b5m.png", 30),
        ("scan 30\u03bcm.png", 30),
        ("10x5um.png", 10),
        ("10um x 10um.png", 10),
        ("10 x 5 um.png", 10),
        ("skin_10UM_200nm.png", 10),
        ("width65um.png", 65),
        ("Butterfly (1.2mm).tif", 1200),
        ("skin 12 microns trace.png", 12),
        ("10um_copy_10um.png", 10),
        ("20x_10um.png", 10),
        ("v2_height_3_65um.png", 65),
    ],
)
def test_a_width_is_found(name, um):
    assert named_width_um(name) == pytest.approx(um, rel=1e-12)


@pytest.mark.parametrize(
    "name",
    [
        "lambda550nm.png",
        "lambda_550nm.png",
        "X100um_v2.png",
        "100umbrella.png",
        "10um5.png",
        "0.05um_per_px.png",
        "10nm pixel.png",
        "pitch-1600nm.png",
        "500 nm period.png",
        "depth 120nm.png",
        "z200nm.png",
        "height_65um.png",
        "1,000um.png",
        "scalebar 10um.png",
        "10um and 20um.png",
        "skin_10.png",
        "10.png",
        "um.png",
        "0um.png",
        "99999999999um.png",
        "10mum.png",
        "1.2.3um.png",
        "633nm_laser.png",
        "",
        "x" * 5000 + "1" * 5000,
    ],
)
def test_no_width_is_made_up(name):
    assert named_width_um(name) is None
