# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's packages: downloading and checking wheels, building and validating a zip for each platform."""

import hashlib
import json
import re
import shutil
import subprocess
import tempfile
import tomllib
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from . import ENVIRONMENTS, ROOT, DevError
from .docs import site
from .environments import DOCS, Environment, require
from .notices import NOTICES, notices_of
from .steps import clean_environment, run_step, run_together, say

MANIFEST = "blender_manifest.toml"
WHEELS = ROOT / "wheels"
HASHES = ROOT / "devtools" / "wheels.sha256"
# Date (the earliest possible), system and mode of every file in a zip.
_DATE, _UNIX, _MODE = (1980, 1, 1, 0, 0, 0), 3, 0o644
# What is compressed already.
_PACKED = (".whl", ".exr", ".png", ".jpg", ".webp", ".woff2")


def manifest() -> dict[str, Any]:
    return tomllib.loads((ROOT / MANIFEST).read_text())


def wheel_names() -> list[str]:
    """The file names of the wheels that the manifest lists."""
    return [Path(wheel).name for wheel in manifest()["wheels"]]


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def known_hashes() -> dict[str, str]:
    """The recorded SHA-256 of each wheel by file name. The record has the format of sha256sum."""
    lines = HASHES.read_text().splitlines() if HASHES.exists() else []
    return {name: digest for digest, name in (line.split() for line in lines)}


def write_hashes() -> None:
    HASHES.write_text("".join(f"{sha256(WHEELS / name)}  {name}\n" for name in sorted(wheel_names())))


def is_genuine(name: str, hashes: dict[str, str]) -> bool:
    path = WHEELS / name
    return path.is_file() and sha256(path) == hashes.get(name)


@dataclass
class Download:
    """One call of pip download: the wheels for one version of Python on one operating system and machine."""

    python_tag: str
    system: str
    platforms: set[str] = field(default_factory=set)
    requirements: list[str] = field(default_factory=list)

    def run(self, environment: Environment) -> None:
        pip = [environment.python, "-m", "pip", "download", "--no-input", "--progress-bar=off", "--no-deps"]
        target = ["--only-binary=:all:", "--dest", WHEELS]
        if self.python_tag.startswith("cp"):
            target += [
                "--implementation=cp",
                f"--python-version={self.python_tag[2:]}",
                f"--abi={self.python_tag}",
            ]
            target += [f"--platform={platform}" for platform in sorted(self.platforms)]
        log = ENVIRONMENTS / "logs" / f"wheels-{self.python_tag}-{self.system}.log"
        run_step(f"wheels for {self.python_tag}, {self.system}", [*pip, *target, *self.requirements], log)


def downloads(names: list[str]) -> list[Download]:
    """The downloads that fetch the wheels with these file names."""
    plan: dict[tuple[str, str], Download] = {}
    for name in names:
        package, version, python_tag, _, platform_tags = name.removesuffix(".whl").split("-")
        # Without the system's version: win_arm64, macosx_arm64, manylinux_x86_64.
        system = re.sub(r"_?\d+_\d+(?=_)|2014", "", platform_tags.rpartition(".")[2])
        download = plan.setdefault((python_tag, system), Download(python_tag, system))
        download.platforms |= set(platform_tags.split("."))
        download.requirements.append(f"{package}=={version}")
    return list(plan.values())


def fetch_wheels(environment: Environment, lock: bool = False) -> None:
    """Download the manifest's wheels into wheels/ and check their SHA-256, or with `lock`, record the SHA-256. Raises
    DevError if a wheel is missing or its SHA-256 differs from the record."""
    hashes = known_hashes()
    wanted = [name for name in wheel_names() if not (WHEELS / name).is_file() or not (lock or is_genuine(name, hashes))]
    for name in wanted:
        (WHEELS / name).unlink(missing_ok=True)
    run_together([partial(download.run, environment) for download in downloads(wanted)])
    if lock:
        write_hashes()
        return
    if false := [name for name in wanted if not is_genuine(name, hashes)]:
        remedy = "./dev build --lock, if their pins were changed on purpose"
        raise DevError(f"wheels missing or not as in {HASHES.name}: {', '.join(false)}; remedy: {remedy}")


def make_drafts(environment: Environment) -> None:
    """Make the draft bakes of the presets in drafts/, unless they are there.

    The number of threads decides in which order NumPy's BLAS adds, which changes the last bits of a table. So drafts
    are baked with one thread, and have their own cache."""
    command = [environment.python, "-m", "devtools.make_drafts"]
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "VECLIB_MAXIMUM_THREADS": "1"}
    places = {"PYTHONPATH": str(ROOT), "NATURAL_GRATINGS_CACHE": str(ENVIRONMENTS / "drafts-cache")}
    run_step("drafts of the presets", command, ENVIRONMENTS / "logs" / "drafts.log", **places, **one_thread)


def extension_tool(environment: Environment, *arguments: str | Path) -> None:
    """Run Blender's own tool for extensions, from the bpy wheel. Raises DevError with its output if it fails."""
    tool = environment.bpy_folder / "scripts" / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    command = [environment.python, tool, *arguments]
    answer = subprocess.run(command, capture_output=True, text=True, env=clean_environment())
    if answer.returncode != 0:
        complaint = " | ".join((answer.stdout + answer.stderr).strip().splitlines())
        raise DevError(f"Blender's extension tool, {arguments[0]}: {complaint}")


def tags(environment: Environment) -> Path:
    """The file of the tags that Blender allows in a manifest."""
    return environment.bpy_folder / "scripts" / "modules" / "_bpy_internal" / "extensions" / "tags.py"


def missing_wheels(package: Path) -> list[str]:
    """Wheels that a zip's manifest lists but the zip lacks. Blender's validator does not check this."""
    with zipfile.ZipFile(package) as archive:
        listed = tomllib.loads(archive.read(MANIFEST).decode())
        held = set(archive.namelist())
    promised = listed["build"]["generated"]["wheels"]
    return [wheel for wheel in promised if wheel.removeprefix("./") not in held]


def validate(package: Path, environment: Environment) -> None:
    """Raise DevError unless a zip is a valid extension with all its wheels."""
    extension_tool(environment, "validate", package, "--valid-tags", tags(environment))
    if missing := missing_wheels(package):
        raise DevError(f"{package.name}: wheels missing in the zip: {', '.join(missing)}")


def rewrite(package: Path, added: Mapping[str, bytes] = MappingProxyType({})) -> None:
    """Rewrite a zip so that its bytes depend only on its files' names and contents: files are sorted, with a fixed date
    and mode. Blender's tool takes order and date from the disk, where they differ from one checkout to the next.
    What is compressed already is stored as it is.
    `added` are files to add or to replace."""
    with tempfile.TemporaryDirectory(dir=package.parent) as folder:
        plain = Path(folder) / package.name
        with zipfile.ZipFile(package) as given, zipfile.ZipFile(plain, "w") as made:
            kept = {item.filename: item for item in given.infolist() if item.filename not in added}
            for name in sorted({*kept, *added}):
                entry = zipfile.ZipInfo(name, _DATE)
                entry.create_system, entry.external_attr = _UNIX, _MODE << 16
                packed = name.endswith(_PACKED)
                entry.compress_type = zipfile.ZIP_STORED if packed else zipfile.ZIP_DEFLATED
                made.writestr(entry, added[name] if name in added else given.read(kept[name]))
        plain.replace(package)


def texts_of(package: Path, website: str) -> dict[str, bytes]:
    """Files for a built zip: the licences of its wheels, and its manifest with a website, if one is given."""
    texts = {NOTICES: notices_of(package).encode()}
    if website:
        with zipfile.ZipFile(package) as archive:
            given = archive.read(MANIFEST).decode()
        # A string of JSON is one of TOML too. Behind the first table it would belong to that table.
        fields, table, rest = given.partition("\n[")
        texts[MANIFEST] = f"{fields}website = {json.dumps(website)}\n{table}{rest}".encode()
    return texts


def manual() -> dict[str, bytes]:
    """The site of docs/ for the zips, which the extension's button opens. Empty if Sphinx cannot be installed: the
    extension then has no such button."""
    try:
        environment = require(DOCS)
    except DevError as fault:
        say(f"packages: without the manual, because {fault}")
        return {}
    return site.files(environment)


def build(environment: Environment, output: Path, lock: bool = False, *, website: str = "") -> list[Path]:
    """Build and validate the zip of each platform, reproducibly. `website` goes into their manifests. Returns their
    paths. No partial zip is left in `output`."""
    fetch_wheels(environment, lock)
    make_drafts(environment)
    pages = manual()
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output, prefix=".build-") as folder:
        say("packages: building ...")
        sources = ("--source-dir", ROOT, "--output-dir", folder, "--split-platforms", "--valid-tags", tags(environment))
        extension_tool(environment, "build", *sources)
        packages = sorted(Path(folder).glob("*.zip"))
        for package in packages:
            rewrite(package, pages | texts_of(package, website))
            validate(package, environment)
        return [Path(shutil.move(package, output / package.name)) for package in packages]
