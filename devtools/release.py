# SPDX-License-Identifier: GPL-3.0-or-later
"""A release in a folder: the zips, their checksums, the notes, and Blender's index, which makes the folder an extension
repository. It is made in the manifest's version, from a clean working tree."""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from . import ROOT, DevError, packages
from .environments import DOCS, Environment, require

CHANGELOG, NOTES, SUMS = "CHANGELOG.md", "RELEASE_NOTES.md", "SHA256SUMS"
_UNRELEASED = "Unreleased"


def release(environment: Environment, output: Path, *, website: str = "", tag: bool = False) -> list[Path]:
    """Make a release in a new folder. With `tag`, also tag the commit; nothing is pushed. Returns the release's files.

    Raises DevError, with nothing made, unless the working tree is clean, the changelog has a section for the version,
    and the version has no tag yet."""
    version = packages.manifest()["version"]
    notes = checked_notes(version)
    if output.exists() and any(output.iterdir()):
        raise DevError(f"{output}: is not empty; remedy: give --output a new folder")
    require(DOCS)  # a build may lack the manual, a release may not
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output.parent, prefix=".release-") as folder:
        made = Path(folder) / output.name
        zips = packages.build(environment, made, website=website)
        (made / SUMS).write_text("".join(f"{packages.sha256(path)}  {path.name}\n" for path in zips))
        (made / NOTES).write_text(f"# Natural Gratings {version}\n\n{notes}\n", encoding="utf-8")
        packages.extension_tool(environment, "server-generate", "--repo-dir", made)
        if output.exists():
            output.rmdir()  # a rename onto an empty folder fails on Windows
        shutil.move(made, output)
    if tag:
        _git("tag", "--annotate", f"v{version}", "--message", f"Natural Gratings {version}")
    return sorted(output.iterdir())


def checked_notes(version: str) -> str:
    """The changelog's section for a version. Raises DevError if it is missing or empty, or if the working tree cannot
    be released."""
    if changed := _git("status", "--porcelain").splitlines():
        raise DevError(f"{changed[0][3:]}: {len(changed)} files are not committed; remedy: commit, or git stash")
    if _git("tag", "--list", f"v{version}"):
        raise DevError(f"the tag v{version} exists; remedy: raise the version in blender_manifest.toml")
    changes = (ROOT / CHANGELOG).read_text(encoding="utf-8")
    if section_of(changes, _UNRELEASED):
        remedy = "raise the version, and name the section after it"
        raise DevError(f"{CHANGELOG}: has changes under [{_UNRELEASED}]; remedy: {remedy}")
    notes = section_of(changes, version)
    if not notes:
        raise DevError(f"{CHANGELOG}: says nothing under [{version}]; remedy: write what has changed")
    return notes


def section_of(changes: str, name: str) -> str:
    """The text of a changelog's section "## [NAME]", without its title. Empty if there is no such section."""
    found = re.search(rf"^## \[{re.escape(name)}\][^\n]*\n(.*?)(?=^## |\Z)", changes, re.MULTILINE | re.DOTALL)
    return found[1].strip() if found else ""


def _git(*arguments: str) -> str:
    """What git prints. Raises DevError with its complaint if it fails."""
    answer = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    if answer.returncode != 0:
        raise DevError(f"git {arguments[0]}: {' | '.join(answer.stderr.split(chr(10))).strip(' |')}")
    return answer.stdout.strip("\n")
