# SPDX-License-Identifier: GPL-3.0-or-later
"""What changes the keys of the cache, and what does not."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from precompute.bake import cache
from precompute.cli.bake_verb import request_of
from precompute.cli.parser import build_parser
from precompute.surface.height_map import HeightMap
from precompute.table import atlas

from .conftest import key_of

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def height_map():
    heights = np.random.default_rng(1).normal(0, 1e-7, (5, 7))
    heights[2, 3] = np.nan
    return HeightMap(heights, (1e-7, 2e-7), "folder/skin.png", "Topography")


def request(*argv):
    arguments = build_parser().parse_args(["bake", "skin.png", "-o", "out", *argv])
    return request_of(arguments)


def test_a_key_is_of_the_content_alone(height_map):
    """The key ignores the folder, the order of heights in memory, and how the command line writes a number."""
    found = key_of([height_map], request())
    assert len(found) == 64
    assert key_of([replace(height_map, source="other/place/skin.png")], request()) == found
    assert key_of([replace(height_map, height_m=np.asfortranarray(height_map.height_m))], request()) == found
    same = request("--delta-e", "1.00", "--coherence-um", "auto", "--json", "-", "--progress", "none", "--no-cache")
    assert key_of([height_map], same) == found
    assert key_of([height_map], request("--level", "plane:least-squares")) == found


def test_each_part_of_the_content_changes_the_key(height_map, monkeypatch):
    one_height = height_map.height_m.copy()
    one_height[4, 6] = np.nextafter(one_height[4, 6], 1)
    changed = [
        replace(height_map, height_m=one_height),
        replace(height_map, height_m=height_map.height_m.reshape(7, 5)),
        replace(height_map, pixel_size_m=(1e-7, 2.1e-7)),
        replace(height_map, pixel_size_m=(2e-7, 1e-7)),
        replace(height_map, periodic=True),
        replace(height_map, channel="Amplitude"),
        replace(height_map, source="folder/scale.png"),
        replace(height_map, source="sample:skin.png"),
    ]
    keys = [key_of([each], request()) for each in (height_map, *changed)]
    monkeypatch.setattr(cache, "BAKE_VERSION", cache.BAKE_VERSION + 1)
    keys.append(key_of([height_map], request()))
    monkeypatch.setattr(cache, "FORMAT", atlas.FORMAT + 1)
    keys.append(key_of([height_map], request()))
    monkeypatch.setattr(np, "__version__", "1.0")
    keys.append(key_of([height_map], request()))
    monkeypatch.setattr(cache.platform, "machine", lambda: "abacus")
    keys.append(key_of([height_map], request()))
    monkeypatch.setattr(np, "show_config", lambda mode: {"SIMD Extensions": {"found": ["AVX2"]}})
    keys.append(key_of([height_map], request()))
    assert len(set(keys)) == len(keys)


@pytest.mark.night("test_each_part_of_the_content_changes_the_key")
def test_a_processor_has_one_key_in_every_process():
    look = "from precompute.bake.cache import _processor; print(_processor())"
    command = [sys.executable, "-c", look]
    told = [subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True) for _ in range(2)]
    assert [(each.stdout, each.stderr) for each in told] == 2 * [(f"{cache._processor()}\n", "")]


def test_each_option_of_the_bake_changes_the_key(height_map, tmp_path):
    needs = tmp_path / "needs.json"
    needs.write_text('{"format": 1, "u": [0, 1]}')
    lines = [(), ("--delta-e", "1.5"), ("--coherence-um", "30"), ("--illuminant", "E"), ("--needs", str(needs))]
    lines += [("--level", steps) for steps in ("none", "plane,dust", "dust,plane", "plane,dust:6", "plane:robust")]
    keys = [key_of([height_map], request(*line)) for line in lines]
    needs.write_text('{"format": 1, "u": [0, 1.5]}')
    keys.append(key_of([height_map], request("--needs", str(needs))))
    keys.append(key_of([height_map, height_map], request()))
    assert len(set(keys)) == len(keys)
