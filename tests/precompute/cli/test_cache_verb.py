# SPDX-License-Identifier: GPL-3.0-or-later
"""`cache list`, `cache prune` and `cache verify`."""

import json
import os
import shutil

import numpy as np
import pytest

from precompute.bake import cache
from precompute.bake.cache import Cache
from precompute.base.shared_folder import server_now_ns
from precompute.table import atlas


def content(number):
    """What a bake depends on."""
    told = {"shape": [1, 1], "pixel_size_m": [1e-7, 1e-7], "source": ["skin.png", "Topography"]}
    return {"surfaces": [{"heights_sha256": f"{number}", **told}], "parameters": {"delta_e": 1.0}}


CONTENTS = sorted(map(content, range(3)), key=cache.key_of)
KEYS = list(map(cache.key_of, CONTENTS))


@pytest.fixture
def filled(cache_folder, tmp_path):
    """The cache with three bakes of 400,000 bytes, last used 0, 10 and 20 days ago."""
    for number, (key, of) in enumerate(zip(KEYS, CONTENTS, strict=True)):
        file, (surface,) = tmp_path / f"skin{number}.exr", of["surfaces"]
        header = {"format": atlas.FORMAT, "request": {"delta_e": 1.0, "scans": []}, **surface}
        header |= {"heights_sha256": [surface["heights_sha256"]], "source": "skin.png", "channel": "Topography"}
        texts = {atlas.HEADER_KEY: json.dumps(header), "padding": "x" * 400_000}
        atlas.write_exr(file, np.zeros((1, 1, 3), np.float32), texts)
        facts = {"seconds": 1.0, "delta_e": {"p99": 0.5 + number}, "files": [str(file)]}
        assert Cache(cache_folder).put(key, tmp_path, facts, of=of)
        at_ns = server_now_ns(tmp_path) - 10 * number * cache.NS_OF_A_DAY
        os.utime(cache_folder / "entries" / key / "record.json", ns=(at_ns, at_ns))
        file.unlink()
    return cache_folder


def entries(folder):
    return sorted(path.name for path in (folder / "entries").iterdir())


def test_a_list_has_one_line_for_each_bake(run, filled):
    (filled / "entries" / KEYS[1] / "files" / "skin1.exr").write_bytes(b"cut")
    record = filled / "entries" / KEYS[2] / "record.json"
    used = record.stat().st_mtime_ns
    record.write_text("[]")
    os.utime(record, ns=(used, used))
    with Cache(filled).hold(KEYS[0]):
        status, out, err = run("cache", "list")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == f"{KEYS[0][:12]}  skin0  0.4 MiB  used 0.0 days ago  dE00 p99 0.50  in use"
    assert lines[1] == f"{KEYS[1][:12]}  skin1  0.0 MiB  used 10.0 days ago  dE00 p99 1.50  damaged"
    assert lines[2] == f"{KEYS[2][:12]}  ?  0.4 MiB  used 20.0 days ago  dE00 p99 unknown  damaged"
    assert lines[3] == f"{filled}: 3 bakes, 0.8 MiB" and len(lines) == 4


def test_a_list_as_json(run, filled):
    status, out, err = run("cache", "list", "--json", "-")
    facts = json.loads(out)
    assert (status, err, facts["folder"]) == (0, "", str(filled))
    assert [each["key"] for each in facts["entries"]] == KEYS
    assert facts["bytes"] == sum(each["bytes"] for each in facts["entries"]) > 1_200_000
    assert facts["entries"][1]["state"] == "whole" and facts["entries"][1]["delta_e_p99"] == 1.5
    # The clock went on by less than a day since the fixture.
    assert 10 <= facts["entries"][1]["unused_days"] < 11


def test_no_cache_is_an_empty_list(run, cache_folder):
    for action in ("list", "prune", "verify"):
        status, out, _ = run("cache", action, "--progress", "none")
        assert status == 0 and out.startswith(f"{cache_folder}: 0 bakes")
    assert not cache_folder.exists()


@pytest.mark.parametrize(("options", "kept"), [
    (["--all"], 0), (["--max-mb", "0"], 0), (["--max-mb", "0.8"], 2), (["--max-mb", "9"], 3), (["--max-days", "15"], 2),
    (["--max-days", "5"], 1), (["--max-days", "15", "--max-mb", "0.4"], 1), ([], 3),
])  # fmt: skip
def test_the_longest_unused_are_pruned(run, filled, options, kept):
    status, out, err = run("cache", "prune", *options, "--dry-run", "--json", "-")
    told = json.loads(out)
    assert (status, err) == (0, "") and entries(filled) == KEYS
    assert [each["key"] for each in told["removed"]] == KEYS[kept:][::-1] and told["kept"] == kept
    status, out, err = run("cache", "prune", *options)
    assert (status, err) == (0, "") and entries(filled) == KEYS[:kept]
    *lines, last = out.splitlines()
    assert [line.split()[:2] for line in lines] == [[KEYS[n][:12], f"skin{n}"] for n in range(2, kept - 1, -1)]
    assert last.endswith(f" removed; {kept} kept")


def test_limits_of_the_environment_are_the_default(run, filled, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_DAYS", "15")
    assert run("cache", "prune")[0] == 0
    assert entries(filled) == KEYS[:2]


def test_a_bake_in_use_is_not_pruned(run, filled):
    with Cache(filled).hold(KEYS[1]):
        for options in (["--dry-run"], []):
            status, out, _ = run("cache", "prune", "--all", *options)
            assert status == 0 and KEYS[1][:12] not in out and out.endswith("1 kept\n")
        assert entries(filled) == [KEYS[1]]


def test_only_bakes_are_pruned(run, filled):
    """Another program's files in the folder stay, and so does everything that a link leads to."""
    (filled / "entries" / ".DS_Store").write_text("theirs")
    (filled / "entries" / "mine").mkdir()
    (filled / "bakes").mkdir()
    assert run("cache", "prune", "--all")[0] == 0
    assert entries(filled) == [".DS_Store", "mine"] and (filled / "bakes").is_dir()


@pytest.mark.parametrize("remove", [False, True])
def test_damage_is_named_and_removed_if_asked(run, filled, remove):
    file = filled / "entries" / KEYS[1] / "files" / "skin1.exr"
    file.write_bytes(b"x" + file.read_bytes()[1:])
    options = ["--remove"] if remove else []
    status, out, err = run("cache", "verify", "--progress", "none", *options)
    assert status == 1
    assert out.startswith(f"{KEYS[1][:12]}  skin1  ") and len(out.splitlines()) == 1
    assert err.startswith(f"error: {filled}: 1 of 3 bakes is damaged; ") and len(err.splitlines()) == 1
    assert entries(filled) == (KEYS[::2] if remove else KEYS)
    status, out, err = run("cache", "verify", "--json", "-")
    assert status == (0 if remove else 1)
    assert [each["key"] for each in json.loads(out)["damaged"]] == ([] if remove else [KEYS[1]])


@pytest.mark.parametrize("damage", ["gone", "link", "record"])
def test_other_damage_is_found(run, filled, tmp_path, damage):
    file = filled / "entries" / KEYS[2] / "files" / "skin2.exr"
    if damage == "record":
        (filled / "entries" / KEYS[2] / "record.json").unlink()
    else:
        kept = tmp_path / "kept.exr"
        file.rename(kept)
        if damage == "link":
            file.symlink_to(kept)
    assert run("cache", "verify")[0] == 1
    assert run("cache", "verify", "--remove")[0] == 1
    assert entries(filled) == KEYS[:2]
    assert run("cache", "verify")[0] == 0


def test_a_bake_of_another_key_is_damage(run, filled):
    """Its whole entry copied; its record made one of the key; its files alone, with their fingerprints; a part of what
    it depends on changed, as it would be with another bake's files."""
    first, second = (filled / "entries" / key for key in KEYS[:2])
    own = json.loads((second / "record.json").read_text())
    shutil.rmtree(second)
    shutil.copytree(first, second)
    others = json.loads((first / "record.json").read_text())
    parts = [{"pixel_size_m": [1, 1]}, {"source": ["other.png", "Topography"]}, {"source": ["skin.png", "Phase"]}]
    changed = [own["of"] | {"surfaces": [own["of"]["surfaces"][0] | part]} for part in parts]
    for record in (others, others | {"of": own["of"]}, own | {"files": others["files"]}, {**own, "of": {}}):
        (second / "record.json").write_text(json.dumps(record))
        assert run("cache", "verify")[0] == 1
    for of in (own["of"], *changed, own["of"] | {"parameters": {"delta_e": 2.0}}):
        assert not cache.is_of(of, [first / "files" / "skin0.exr"])
    assert run("cache", "verify", "--remove")[0] == 1 and entries(filled) == KEYS[::2]


def test_a_bake_of_another_version_is_no_damage(run, filled):
    """Its header may have another form. It can be damaged, too."""
    entry = filled / "entries" / KEYS[1]
    made_of = {"versions": [atlas.FORMAT, cache.BAKE_VERSION - 1]}
    record = json.loads((entry / "record.json").read_text()) | {"of": made_of}
    key = cache.key_of(made_of)
    (entry / "record.json").write_text(json.dumps(record))
    entry = entry.rename(filled / "entries" / key)
    assert "of another version" in next(line for line in run("cache", "list")[1].splitlines() if key[:12] in line)
    told = f"{filled}: 3 bakes, none is damaged; 1 of another version, which only `cache prune` removes\n"
    assert run("cache", "verify", "--remove", "--progress", "none") == (0, told, "")
    (entry / "files" / "skin1.exr").write_bytes(b"cut")
    assert run("cache", "verify")[0] == 1


def test_a_bake_in_use_is_not_called_damaged(run, filled):
    (filled / "entries" / KEYS[1] / "files" / "skin1.exr").unlink()
    with Cache(filled).hold(KEYS[1]):
        assert run("cache", "verify", "--remove")[0] == 0
    assert entries(filled) == KEYS


def test_verification_shows_progress(run, filled):
    status, _, err = run("cache", "verify", "--progress", "json")
    reports = [json.loads(line) for line in err.splitlines()]
    assert status == 0 and {each["stage"] for each in reports} == {"verifying"}
    assert [each["fraction"] for each in reports] == pytest.approx([0, 1 / 3, 2 / 3, 1], abs=1e-3)


@pytest.mark.parametrize("argv", [[], ["lost"], ["prune", "--max-mb", "-1"], ["prune", "--max-days", "nan"]])
def test_refusals(refused, filled, argv):
    refused("cache", *argv, status=2)
    assert entries(filled) == KEYS


def test_a_folder_that_cannot_be_changed_is_told(refused, run, filled, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    for line in (["prune", "--all"], ["verify", "--remove"]):
        assert "cannot be changed by this user" in refused("cache", *line)
    assert run("cache", "prune", "--all", "--dry-run")[0] == run("cache", "verify")[0] == 0
    assert entries(filled) == KEYS
