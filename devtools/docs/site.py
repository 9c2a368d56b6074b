# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev docs`: builds the site of docs/ with Sphinx, and checks it."""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from .. import ROOT, DevError
from ..environments import BPY45, Environment, require
from ..machine import ensure_blender_libraries
from ..steps import clean_environment, project_environment, say
from .pages import DOCS, faults_of_pages

# What a browser loads from another host when it opens a page. Links that a reader clicks do not count.
_LOADED = re.compile(r"<(?:link|script|img|iframe|source)\b[^>]*?\b(?:href|src)=\"((?:https?:)?//[^\"]*)")
# A file that Sphinx writes into each site.
_MARK = "objects.inv"
# The folder of the site in a zip, where the extension's button looks for it.
IN_ZIP = "manual"
# The packages whose scripts and styles are in the site.
_SCRIPTS = ("furo", "sphinx", "snowballstemmer", "pygments")


def build(environment: Environment, output: Path, *, external: bool = False) -> list[str]:
    """Build the site anew in the folder `output`, and check it; `external` also fetches the links into the web. Returns
    a line for each warning and fault. Raises DevError if `output` holds something else, or if Sphinx fails."""
    if output.exists() and any(output.iterdir()) and not (output / _MARK).exists():
        raise DevError(f"--output {output}: holds no site; remedy: choose an empty folder")
    say("site: building ...")
    with tempfile.TemporaryDirectory() as folder:
        site = Path(folder, "site")
        faults = _sphinx(environment, "html", site)
        faults += [f"{page.relative_to(site)}: {fault}" for page in sorted(site.glob("*.html"))
                   for fault in loaded_from_outside(page.read_text(encoding="utf-8"))]  # fmt: skip
        if external:
            faults += _sphinx(environment, "linkcheck", Path(folder, "links"))
        shutil.rmtree(output, ignore_errors=True)
        output.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(site, output)
    return faults + faults_of_pages()


def files(environment: Environment) -> dict[str, bytes]:
    """Build the site. Returns the files that a zip ships, by their names in the zip. They depend only on the pages and
    the commands. The theme's maps stay, because its minified scripts can be read with them."""
    say("manual: building ...")
    with tempfile.TemporaryDirectory() as folder:
        site = Path(folder, "site")
        _sphinx(environment, "html", site)
        shipped = [path for path in site.rglob("*") if path.is_file() and path.name not in (_MARK, ".buildinfo")]
        found = {path.relative_to(site).as_posix(): path.read_bytes() for path in shipped}
    found["LICENSES.txt"] = _licences(environment)
    return {f"{IN_ZIP}/{name}": content for name, content in found.items()}


def _licences(environment: Environment) -> bytes:
    """The licences of the scripts and styles that others wrote."""
    folders = [f"lib/*/site-packages/{name}-*.dist-info/licenses/*" for name in _SCRIPTS]
    return b"\n\n".join(path.read_bytes() for each in folders for path in sorted(environment.folder.glob(each)))


def _sphinx(environment: Environment, builder: str, folder: Path) -> list[str]:
    """Run a builder of Sphinx on the pages and the page of all commands. Returns its warnings. Nothing is kept from one
    run to the next, because Sphinx does not repeat the warnings of a page that has not changed."""
    pages = shutil.copytree(DOCS, folder.with_suffix(".docs"))
    shutil.copy(ROOT / "CITATION.cff", pages.parent)  # which a page links
    _write_commands(pages / "commands.md")
    command = [environment.python, "-m", "sphinx", "--quiet", "--no-color", "--builder", builder]
    command += ["--doctree-dir", folder.with_suffix(".doctrees"), pages, folder]
    # Sphinx ends at once if the machine lacks the user's locale.
    answer = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=clean_environment(LC_ALL="C.UTF-8"))
    warnings = answer.stderr.replace(f"{pages}/", "docs/").strip().splitlines()
    if answer.returncode > 1 or answer.returncode and not warnings:
        raise DevError(f"Sphinx, {builder}: {' | '.join(warnings[-3:])}")
    return warnings


def _write_commands(path: Path) -> None:
    """Write the page of all commands. It is made in Blender 4.5, because Python's versions print help differently."""
    ensure_blender_libraries()
    command = [require(BPY45).python, "-m", "devtools.docs.commands", path]
    answer = subprocess.run(command, capture_output=True, text=True, env=project_environment())
    if answer.returncode != 0:
        raise DevError(f"the page of commands: {answer.stderr.strip().splitlines()[-1]}")


def loaded_from_outside(html: str) -> list[str]:
    """List what a page loads from the web. The site must work without a network."""
    return [f"{address} comes from the web" for address in _LOADED.findall(html)]


def megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
