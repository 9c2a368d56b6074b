# SPDX-License-Identifier: GPL-3.0-or-later
"""The licences of the wheels in a zip, as one text for the zip.

A wheel has its package's licence. Of most libraries that are compiled into it, it has none: devtools/licences/ has
those, taken from the packages' sources. Check them whenever a pin changes."""

import email
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path

from . import DevError

# The text's name in the zip.
NOTICES = "THIRD_PARTY_LICENSES.txt"
_MORE = Path(__file__).parent / "licences"
# The licence of each package by its SPDX name. Not every wheel says it in its metadata.
_SPDX = {"openexr": "BSD-3-Clause", "pillow": "MIT-CMU", "xatlas": "MIT"}
_HEAD = """\
Natural Gratings is under the GPL, version 3 or later: see LICENSE. The folder wheels/ holds these packages of others,
unmodified. Blender unpacks the wheel that fits its Python. The licences follow.
"""
_RULE = "=" * 80 + "\n"


def notices_of(package: Path) -> str:
    """The licences of a zip's wheels. Raises DevError for a wheel without a known licence."""
    packages: dict[str, list[str]] = {}
    with zipfile.ZipFile(package) as archive:
        for path in sorted(name for name in archive.namelist() if name.endswith(".whl")):
            title, texts = _licence_of(Path(path).name, archive.read(path))
            packages.setdefault(title, []).extend(text for text in texts if text not in packages.get(title, []))
    sections = [f"{title}\n\n" + "\n\n".join(texts) for title, texts in packages.items()]
    return _RULE.join([_HEAD + "\n" + "".join(f"{title}\n" for title in packages), *sections])


def _licence_of(name: str, wheel: bytes) -> tuple[str, list[str]]:
    """A wheel's title, "package version, licence, home page", and the texts of its licences."""
    package, version = name.split("-")[:2]
    with zipfile.ZipFile(io.BytesIO(wheel)) as archive:
        texts = [archive.read(path).decode() for path in archive.namelist() if ".dist-info/licenses/LICENSE" in path]
        (metadata,) = (archive.read(path) for path in archive.namelist() if path.endswith(".dist-info/METADATA"))
    if not texts or package not in _SPDX:
        raise DevError(f"{name}: has no licence; remedy: find its licence, and name it in devtools/notices.py")
    more = _MORE / f"{package}.txt"
    texts += [more.read_text()] if more.exists() else []
    title = ", ".join([f"{package} {version}", _SPDX[package], *_home_page(metadata)])
    return title, ["\n".join(text.splitlines()).strip() + "\n" for text in texts]


def _home_page(metadata: bytes) -> Iterator[str]:
    """The home page in a wheel's metadata, if it has one."""
    for entry in email.message_from_bytes(metadata).get_all("Project-URL", []):
        label, _, url = entry.partition(", ")
        if label == "Homepage":
            yield url
