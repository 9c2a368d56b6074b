# SPDX-License-Identifier: GPL-3.0-or-later
"""The contents of the zips; a faulty zip is rejected."""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from devtools import ROOT, DevError, environments, packages
from devtools.notices import NOTICES, notices_of
from devtools.steps import clean_environment
from precompute.presets.presets import preset_names

from .conftest import copy_checkout

# The start and the end of each platform's wheels.
WHEELS_OF = {
    "linux_x64": ("manylinux", "x86_64"),
    "windows_x64": ("win", "amd64"),
    "windows_arm64": ("win", "arm64"),
    "macos_arm64": ("macosx", "arm64"),
}
PLATFORMS = tuple(WHEELS_OF)
# Packages that have no wheel, by platform and Python.
UNAVAILABLE = {("windows_arm64", "cp311"): {"xatlas"}, ("windows_arm64", "cp313"): {"xatlas"}}
TOP_LEVEL = {
    "__init__.py", "blender_manifest.toml", "LICENSE", NOTICES, "addon", "drafts", "manual", "precompute", "wheels",
}  # fmt: skip

# Builds the zips in another checkout, with the environments of this one, but an empty cache of drafts, and with a umask
# that hides new files from other users.
OTHER_BUILD = """
import os
import sys
from pathlib import Path
sys.path.insert(0, {checkout!r})
from devtools import environments, packages
packages.ENVIRONMENTS = Path({cache!r})
environments.ENVIRONMENTS = Path({environments!r})
assert packages.ROOT == Path({checkout!r})
os.umask(0o077)
packages.build(environments.require(environments.BPY45), Path({output!r}))
"""


def names(package: Path) -> list[str]:
    with zipfile.ZipFile(package) as archive:
        return archive.namelist()


def wheels(package: Path) -> list[str]:
    return [Path(name).name for name in names(package) if name.endswith(".whl")]


def without(package: Path, unwanted: str, target: Path) -> Path:
    """A copy of the zip without the files whose names contain `unwanted`."""
    with zipfile.ZipFile(package) as whole, zipfile.ZipFile(target, "w") as part:
        for item in whole.infolist():
            if unwanted not in item.filename:
                part.writestr(item, whole.read(item))
    return target


def test_there_is_a_zip_for_each_platform(built):
    assert sorted(built) == sorted(PLATFORMS)


@pytest.mark.parametrize("platform", PLATFORMS)
def test_zip_holds_the_extension_and_nothing_else(built, platform):
    held = names(built[platform])
    assert {name.partition("/")[0] for name in held} <= TOP_LEVEL
    assert {"__init__.py", "addon/__init__.py", "precompute/__init__.py", "LICENSE"} <= set(held)
    assert {f"drafts/{preset}/draft.json" for preset in preset_names()} <= set(held)
    assert {f"manual/{page.stem}.html" for page in (ROOT / "docs").glob("*.md")} <= set(held)
    assert not [name for name in held if name.endswith(".pyc")]


@pytest.mark.parametrize("platform", PLATFORMS)
@pytest.mark.parametrize("python_tag", ["cp311", "cp313"])
def test_zip_holds_the_runtime_pins_for_each_python(built, platform, python_tag):
    fitting = {
        "{}=={}".format(*wheel.split("-")[:2])
        for wheel in wheels(built[platform])
        if f"-{python_tag}-" in wheel or wheel.endswith("-py3-none-any.whl")
    }
    unavailable = UNAVAILABLE.get((platform, python_tag), set())
    pins = {pin.lower() for pin in environments.dependency_group("runtime")}
    assert fitting == {pin for pin in pins if pin.partition("==")[0] not in unavailable}


def test_linux_s_zip_holds_openexr_alone_for_the_python_of_distributions(built):
    assert [wheel.partition("-")[0] for wheel in wheels(built["linux_x64"]) if "-cp314-" in wheel] == ["openexr"]


@pytest.mark.parametrize("platform", PLATFORMS)
def test_no_zip_has_another_size_than_its_page_says(built, platform):
    """Up to a twentieth, so that a new preset's draft does not go unnoticed."""
    page = (ROOT / "docs" / "packages.md").read_text()
    stated = float(re.search(rf"^\| `{platform}` \| ([\d.]+) MB ", page, re.MULTILINE)[1])
    assert built[platform].stat().st_size / 1e6 == pytest.approx(stated, rel=0.05)


@pytest.mark.parametrize("platform", PLATFORMS)
def test_zip_holds_no_wheel_of_another_platform(built, platform):
    start, end = WHEELS_OF[platform]
    held = [wheel.removesuffix(".whl").rpartition("-")[2] for wheel in wheels(built[platform])]
    assert all(tag.startswith(start) and tag.endswith(end) for tag in held)


@pytest.mark.parametrize("platform", PLATFORMS)
def test_zip_names_each_wheel_with_its_licence_and_its_text(built, platform):
    with zipfile.ZipFile(built[platform]) as archive:
        notices = archive.read(NOTICES).decode()
    contents, *texts = notices.split("=" * 80 + "\n")
    licences = {"openexr": "BSD-3-Clause", "pillow": "MIT-CMU", "xatlas": "MIT"}
    for name in wheels(built[platform]):
        package, version = name.split("-")[:2]
        line = next(line for line in contents.splitlines() if line.startswith(f"{package} {version}, "))
        assert line.split(", ")[1] == licences[package]
        with zipfile.ZipFile(packages.WHEELS / name) as wheel:
            (own,) = [wheel.read(held).decode() for held in wheel.namelist() if ".dist-info/licenses/LICENSE" in held]
        assert any(" ".join(own.split()) in " ".join(text.split()) for text in texts), name


def test_libraries_within_the_wheels_have_their_licences_too(built):
    """Of these libraries the wheels' own licence files say nothing."""
    with zipfile.ZipFile(built["windows_x64"]) as archive:
        notices = archive.read(NOTICES).decode()
    for library in ("libdeflate", "OpenJPH", "Zstandard", "pybind11", "OpenNL", "thekla_atlas and Fast-BVH"):
        assert f"--- {library}" in notices


def test_a_wheel_without_a_licence_is_refused(built, tmp_path):
    wheel = without(packages.WHEELS / wheels(built["linux_x64"])[0], "LICENSE", tmp_path / "openexr-1-cp311-a-b.whl")
    package = tmp_path / "a.zip"
    with zipfile.ZipFile(package, "w") as made:
        made.write(wheel, f"wheels/{wheel.name}")
    with pytest.raises(DevError, match="openexr-1-cp311-a-b.whl: has no licence"):
        notices_of(package)


@pytest.mark.parametrize("platform", PLATFORMS)
@pytest.mark.parametrize("environment", environments.ALL, ids=lambda one: one.name)
def test_zip_is_valid_for_each_blender(built, platform, environment):
    if not environments.is_ready(environment):
        pytest.skip(f"{environment.name} is not made: Python {environment.python_version} is missing")
    packages.validate(built[platform], environment)


def test_a_zip_s_bytes_do_not_depend_on_dates_order_and_modes(tmp_path):
    files = {"a/b.py": b"1", "a.txt": b"2" * 999}
    for number, names in enumerate((list(files), list(files)[::-1])):
        with zipfile.ZipFile(tmp_path / f"{number}.zip", "w") as package:
            for name in names:
                item = zipfile.ZipInfo(name, (2000 + number, 1, 1, 0, 0, 0))
                item.external_attr, item.compress_type = (0o600 + number) << 16, zipfile.ZIP_DEFLATED
                package.writestr(item, files[name])
        packages.rewrite(tmp_path / f"{number}.zip")
    assert (tmp_path / "0.zip").read_bytes() == (tmp_path / "1.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "0.zip") as package:
        assert {name: package.read(name) for name in package.namelist()} == files
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.zip", "1.zip"]


def test_without_sphinx_a_build_has_no_manual(monkeypatch, capsys):
    def refuse(_):
        raise DevError("docs: no network")

    monkeypatch.setattr(packages, "require", refuse)
    assert packages.manual() == {}
    assert capsys.readouterr().err == "[dev] packages: without the manual, because docs: no network\n"


def test_zip_without_a_promised_wheel_is_refused(built, tmp_path):
    package = without(built["linux_x64"], "openexr-3.5.3-cp313", tmp_path / "natural_gratings.zip")
    with pytest.raises(DevError, match="openexr-3.5.3-cp313"):
        packages.validate(package, environments.BPY45)


def test_zip_without_manifest_is_refused(built, tmp_path):
    package = without(built["linux_x64"], "blender_manifest", tmp_path / "natural_gratings.zip")
    with pytest.raises(DevError, match="validate"):
        packages.validate(package, environments.BPY45)


def test_every_wheel_has_a_known_hash():
    assert set(packages.known_hashes()) == set(packages.wheel_names())


def test_the_manifest_names_the_copyright_s_owner():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    assert manifest["copyright"] == [f"2026 {manifest['maintainer']}"]
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]


def test_file_permission_is_asked_for_with_its_reason():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    assert set(manifest["permissions"]) == {"files"}


@pytest.fixture
def other_checkout(tmp_path):
    """This checkout in another folder, with the wheels, and the drafts of all presets but one."""
    folder = copy_checkout(tmp_path / "a checkout elsewhere")
    shutil.rmtree(folder / "drafts" / "gold_foil")
    return folder


@pytest.mark.night("tests/package/test_release.py")
def test_another_checkout_builds_the_same_bytes(built, other_checkout, tmp_path):
    """It bakes one of the drafts again, without the cache. On another kind of processor its table would differ in the
    last bits, as docs/packages.md says."""
    texts = {"checkout": other_checkout, "cache": tmp_path / "cache", "output": tmp_path, "environments": ROOT / ".env"}
    script = OTHER_BUILD.format(**{name: str(path) for name, path in texts.items()})
    subprocess.run([sys.executable, "-c", script], check=True, env=clean_environment(), cwd=tmp_path)
    assert (other_checkout / "drafts" / "gold_foil" / "draft.json").is_file()
    assert (tmp_path / "cache" / "drafts-cache" / "entries").is_dir(), "the draft came from elsewhere"
    assert {path.name: packages.sha256(path) for path in tmp_path.glob("*.zip")} == {
        path.name: packages.sha256(path) for path in built.values()
    }
