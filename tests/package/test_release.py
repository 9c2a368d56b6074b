# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev release`: what it refuses, what it makes, and Blender installing from the made folder."""

import functools
import json
import re
import subprocess
import sys
import threading
import tomllib
import zipfile
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from devtools import ROOT, DevError, cli, environments, packages, release
from devtools.steps import clean_environment

from .conftest import Blender, binary_command, copy_checkout

VERSION = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
CHANGES = f"# Changelog\n\n## [Unreleased]\n\n## [{VERSION}] - 2026-11-24\n\n- One change.\n\n## [0.0.1]\n\n- Older.\n"
WEBSITE = "https://example.org/gratings"
# Makes a release in another checkout, with the environments of this one.
RELEASE = """
import sys
from pathlib import Path
sys.path.insert(0, {checkout!r})
from devtools import environments, packages, release
packages.ENVIRONMENTS = environments.ENVIRONMENTS = Path({environments!r})
for path in release.release(environments.BPY45, Path({output!r}), website={website!r}, tag=True):
    print(path)
"""


def git(folder, *arguments):
    identity = ["-c", "user.name=Tester", "-c", "user.email=tester@example.org"]
    command = ["git", *identity, *arguments]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


def commit(folder):
    git(folder, "init", "--quiet")
    git(folder, "config", "user.name", "Tester")  # an annotated tag has its tagger
    git(folder, "config", "user.email", "tester@example.org")
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--message", "All")


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A small repository in place of this one, fit for a release."""
    folder = tmp_path / "small"
    folder.mkdir()
    (folder / "CHANGELOG.md").write_text(CHANGES)
    commit(folder)
    monkeypatch.setattr(release, "ROOT", folder)
    return folder


def test_the_notes_are_the_version_s_section(small):
    assert release.checked_notes(VERSION) == "- One change."


def test_a_file_that_is_not_committed_is_refused(small):
    (small / "new.py").touch()
    with pytest.raises(DevError, match="new.py: 1 files are not committed; remedy"):
        release.checked_notes(VERSION)


@pytest.mark.parametrize("changes", ["", "# Changelog\n", CHANGES.replace("- One change.\n", "")])
def test_a_version_without_notes_is_refused(small, changes):
    (small / "CHANGELOG.md").write_text(changes)
    commit(small)
    with pytest.raises(DevError, match=re.escape(f"CHANGELOG.md: says nothing under [{VERSION}]; remedy")):
        release.checked_notes(VERSION)


def test_changes_that_belong_to_no_version_are_refused(small):
    (small / "CHANGELOG.md").write_text(CHANGES.replace("[Unreleased]\n", "[Unreleased]\n\n- Another.\n"))
    commit(small)
    with pytest.raises(DevError, match=r"has changes under \[Unreleased\]"):
        release.checked_notes(VERSION)


def test_a_version_with_a_tag_is_refused(small):
    git(small, "tag", f"v{VERSION}")
    with pytest.raises(DevError, match=f"the tag v{VERSION} exists; remedy"):
        release.checked_notes(VERSION)


def test_a_folder_that_holds_files_is_refused(small, tmp_path):
    with pytest.raises(DevError, match="is not empty; remedy: give --output a new folder"):
        release.release(environments.BPY45, tmp_path)


def test_a_website_that_is_no_address_is_refused(capsys):
    assert cli.main(["release", "--website", "example.org"]) == 1
    assert capsys.readouterr().err == "error: --website example.org: is no address; remedy: begin it with https://\n"


@pytest.fixture(scope="module")
def released(built, tmp_path_factory):
    """The folder of a release with a tag, and the checkout that it was made from."""
    place = tmp_path_factory.mktemp("release")
    checkout = copy_checkout(place / "checkout")
    (checkout / "CHANGELOG.md").write_text(CHANGES)
    commit(checkout)
    texts = {"checkout": checkout, "environments": ROOT / ".env", "output": place / "made"}
    script = RELEASE.format(**{name: str(path) for name, path in texts.items()}, website=WEBSITE)
    command = [sys.executable, "-c", script]
    # The umask hides new files from other users.
    subprocess.run(command, check=True, env=clean_environment(), cwd=place, umask=0o077)
    assert sorted(path.name for path in place.iterdir()) == ["checkout", "made"]
    return place / "made", checkout


def test_a_release_has_zips_checksums_notes_and_an_index(released, built):
    folder, checkout = released
    zips = sorted(path.name for path in built.values())
    others = ["RELEASE_NOTES.md", "SHA256SUMS", "index.json"]
    assert sorted(path.name for path in folder.iterdir()) == sorted([*zips, *others])
    sums = dict(line.split()[::-1] for line in (folder / "SHA256SUMS").read_text().splitlines())
    assert sums == {name: packages.sha256(folder / name) for name in zips}
    assert (folder / "RELEASE_NOTES.md").read_text() == f"# Natural Gratings {VERSION}\n\n- One change.\n"
    listed = json.loads((folder / "index.json").read_text())["data"]
    assert {each["archive_url"]: each["archive_hash"] for each in listed} == {
        f"./{name}": f"sha256:{sums[name]}" for name in zips
    }
    assert {each["website"] for each in listed} == {WEBSITE}
    assert git(checkout, "cat-file", "-t", f"v{VERSION}") == "tag"
    assert git(checkout, "rev-list", "-n", "1", f"v{VERSION}") == git(checkout, "rev-parse", "HEAD")


def facts(item):
    return item.filename, item.date_time, item.create_system, item.external_attr, item.compress_type


def test_a_release_s_zips_differ_from_a_build_s_only_in_the_website(released, built):
    """Nor do dates, modes and the order of files, although another umask made them later in another checkout."""
    folder, _ = released
    for path in built.values():
        with zipfile.ZipFile(path) as plain, zipfile.ZipFile(folder / path.name) as made:
            assert [facts(item) for item in plain.infolist()] == [facts(item) for item in made.infolist()]
            changed = [name for name in plain.namelist() if plain.read(name) != made.read(name)]
            assert changed == ["blender_manifest.toml"]
            assert tomllib.loads(made.read(changed[0]).decode())["website"] == WEBSITE
        packages.validate(folder / path.name, environments.BPY45)


class Quiet(SimpleHTTPRequestHandler):
    """A static server that prints nothing."""

    def log_message(self, *_):
        pass


@pytest.fixture
def address(released):
    """The web address of the release's index, behind a static server."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(released[0])))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/index.json"
    server.shutdown()
    server.server_close()


@pytest.fixture(params=["server", "folder"])
def url(request, released):
    """The address of the release's index: behind a server, or in a folder."""
    if request.param == "server":
        return request.getfixturevalue("address")
    return (released[0] / "index.json").as_uri()


def test_blender_installs_from_the_release_as_a_repository(url, tmp_path):
    """The commands of docs/packages.md. --clear-all leaves Blender's own online repository out of the test."""
    blender = Blender(binary_command(), tmp_path / "user")
    (tmp_path / "user").mkdir()
    blender.run("--command", "extension", "repo-add", "--clear-all", "--url", url, "--name", "Studio", "studio")
    install = ("install", "--sync", "--enable", "studio.natural_gratings")
    blender.run("--online-mode", "--command", "extension", *install)
    assert "render the open file's scene" in blender.run("--background", "--command", "grating", "--help")
    blender.run_grating("bake", "sample:blazed", "--delta-e", "6", "--coherence-um", "4", "-o", tmp_path / "bake")
    assert (tmp_path / "bake" / "blazed.exr").is_file()


def test_blender_installs_a_zip_from_the_command_line(built, tmp_path):
    blender = Blender(binary_command(), tmp_path / "user")
    (tmp_path / "user").mkdir()
    install = ("install-file", "--repo", "user_default", "--enable", built["linux_x64"])
    blender.run("--command", "extension", *install)
    assert "render the open file's scene" in blender.run("--background", "--command", "grating", "--help")
