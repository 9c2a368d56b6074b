# SPDX-License-Identifier: GPL-3.0-or-later
"""`python daily_blender.py FOLDER`: downloads Blender's newest daily build for this system, checks its SHA-256, unpacks
it into FOLDER, and prints the path of the program. It needs only Python, on Linux, Windows and macOS."""

import argparse
import hashlib
import json
import platform
import shutil
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

LIST = "https://builder.blender.org/download/daily/?format=json&v=1"
# By Python's name of the system: the list's platform, architectures, and file type, and where the program is.
SYSTEMS = {
    "Linux": ("linux", ("x86_64", "amd64"), "xz", "*/blender"),
    "Windows": ("windows", ("amd64", "x86_64"), "zip", "*/blender.exe"),
    "Darwin": ("darwin", ("arm64",), "dmg", "Blender.app/Contents/MacOS/Blender"),
}
_LONGEST_SECONDS = 600


def newest(builds: Sequence[dict[str, Any]], system: str, branch: str = "main") -> dict[str, Any]:
    """The newest build of a branch for a system. Ends this program if there is none."""
    name, architectures, kind, _ = SYSTEMS[system]
    fitting = [
        build
        for build in builds
        if (build["platform"], build["branch"], build["file_extension"]) == (name, branch, kind)
        and build["architecture"] in architectures
    ]
    if not fitting:
        sys.exit(f"error: no daily build of {branch} for {name}; see {LIST}")
    return max(fitting, key=lambda build: build["file_mtime"])


def fetch(url: str) -> bytes:
    """A file of Blender's servers."""
    if not url.startswith(("https://builder.blender.org/", "https://cdn.builder.blender.org/")):
        sys.exit(f"error: {url}: not on Blender's server")
    request = urllib.request.Request(url, headers={"User-Agent": "natural-gratings-nightly"})
    with urllib.request.urlopen(request, timeout=_LONGEST_SECONDS) as answer:
        return answer.read()


def check(data: bytes, record: str, name: str) -> None:
    """End this program unless the record, a line of sha256sum, is that of the data."""
    words = record.split()
    if not words or hashlib.sha256(data).hexdigest() != words[0].lower():
        sys.exit(f"error: {name}: its SHA-256 is not the recorded one; try again")


def unpack(archive: Path, folder: Path, system: str) -> Path:
    """Unpack an archive. Returns the path of the program in it."""
    kind, program = SYSTEMS[system][2:]
    if kind == "xz":
        with tarfile.open(archive) as held:
            held.extractall(folder, filter="data")
    elif kind == "zip":
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(folder)
    else:
        mount = folder / "mounted"
        subprocess.run(["hdiutil", "attach", "-nobrowse", "-readonly", "-mountpoint", mount, archive], check=True)
        try:
            shutil.copytree(mount / "Blender.app", folder / "Blender.app", symlinks=True)
        finally:
            subprocess.run(["hdiutil", "detach", mount], check=True)
    found = sorted(folder.glob(program))
    if len(found) != 1:
        sys.exit(f"error: {archive.name}: {len(found)} programs {program} in it, not one")
    return found[0]


def main() -> None:
    made = argparse.ArgumentParser(description="Downloads Blender's newest daily build for this system.")
    made.add_argument("folder", type=Path, metavar="FOLDER", help="an empty or new folder")
    folder = made.parse_args().folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    system = platform.system()
    build = newest(json.loads(fetch(LIST)), system)
    print(f"Blender {build['version']} {build['risk_id']}, {build['hash']}", file=sys.stderr)
    data = fetch(build["url"])
    check(data, fetch(f"{build['url']}.sha256").decode("ascii"), build["file_name"])
    archive = folder / Path(build["file_name"]).name
    archive.write_bytes(data)
    print(unpack(archive, folder, system))
    archive.unlink()


if __name__ == "__main__":
    main()
