# SPDX-License-Identifier: GPL-3.0-or-later
"""`python nightly.py ZIP --blender BLENDER --output FOLDER`: installs the zip into an empty Blender and tests it.

It needs only Python and Blender, on Linux, Windows and macOS. The steps are scripts of tests/package and verbs of the
installed extension. It ends with status 1 after the first step that fails. FOLDER gets the pictures and the log."""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
TESTS = HERE.parent / "tests" / "package"
COMPARE, RECORDS = HERE / "nightly_in_blender.py", HERE / "nightly.json"
ENGINES = ("CYCLES", "EEVEE")
# Wide spectra without sharp edges, so that the noise in a cell of the picture is small.
ROUGH = ("--set", "Roughness=0.12")
# Seconds for a step. The longest, the bake, takes 10 s on two cores.
_LONGEST_SECONDS = 900


class Stage:
    """A Blender with an empty user folder, and the log of its steps."""

    def __init__(self, blender: str, user: Path, output: Path) -> None:
        self._blender, self._user, self._output = blender, user, output
        self._log = output / "log.txt"

    def run(self, name: str, *arguments: str | Path, user: Path | None = None) -> None:
        """Run Blender with arguments as one step. Ends this program with status 1 if the step fails."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "BLENDER_"))}
        environment["BLENDER_USER_RESOURCES"] = str(user or self._user)
        environment["NATURAL_GRATINGS_CACHE"] = str(self._user / "cache")
        # Mesa maps its cache of shaders. If another process shortens the file, Blender ends with SIGBUS.
        environment["MESA_SHADER_CACHE_DIR"] = str(self._user / "shaders")
        command = [self._blender, *map(str, arguments)]
        try:
            answer = subprocess.run(
                command, env=environment, timeout=_LONGEST_SECONDS, capture_output=True, encoding="utf-8",
                errors="replace", stdin=subprocess.DEVNULL,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as fault:
            sys.exit(f"error: {name}: {fault}")
        told = f"{answer.stdout}{answer.stderr}"
        with self._log.open("a", encoding="utf-8") as log:
            log.write(f"== {name}: {command}\n{told}\n")
        print(f"{'ok' if answer.returncode == 0 else 'FAILED':8}{name}", flush=True)
        for line in told.splitlines():
            if line.startswith(tuple(f"{engine}:" for engine in ENGINES)):
                print(f"        {line}", flush=True)
        if answer.returncode != 0:
            sys.exit(f"{told}\nerror: {name}: status {answer.returncode}")

    def script(self, name: str, path: Path, *arguments: str | Path, file: Path | None = None) -> None:
        """Run a script in a Blender without a window, as one step."""
        opened = [file] if file else []
        self.run(name, "--background", *opened, "--python-exit-code", "1", "--python", path, "--", *arguments)

    def verb(self, name: str, *arguments: str | Path, file: Path | None = None) -> None:
        """Run a verb of the installed extension, as one step."""
        self.run(name, "--background", *([file] if file else []), "--command", "grating", *arguments)


def main(argv: Sequence[str] | None = None) -> None:
    arguments = parser().parse_args(argv)
    if not arguments.zip.is_file():  # Blender's own command says so, and exits with 0
        sys.exit(f"error: {arguments.zip}: no such file; name the zip for this system in dist")
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="nightly-", ignore_cleanup_errors=True) as folder:
        user, bare = Path(folder) / "user", Path(folder) / "bare"
        for each in (user, bare):
            each.mkdir()
        stage = Stage(arguments.blender, user, output)
        install(stage, arguments.zip.resolve())
        plane = output / "plane.blend"
        stage.script("a plane, a sun and a camera", TESTS / "make_plane.py", plane)
        stage.verb("a bake", "bake", "sample:blazed", "--delta-e", "6", "-o", output / "bake")
        stage.verb(
            "the bake on the plane",
            "assign",
            output / "bake",
            "--object",
            "Plane",
            "--lights",
            "lamps",
            *ROUGH,
            file=plane,
        )
        record = ["record"] if arguments.record else []
        for engine in arguments.engines:
            stage.script(f"a picture by {engine}", COMPARE, engine, output, RECORDS, *record, file=plane)
        if "CYCLES" in arguments.engines:
            without_the_extension(stage, plane, output, bare)
        if arguments.window:
            press(stage, output)


def install(stage: Stage, package: Path) -> None:
    """Install the zip as a user does from the command line, and check it in later sessions."""
    stage.run("Blender starts", "--background", "--version")
    stage.run(
        "the zip is installed", "--command", "extension", "install-file", "-r", "user_default", "--enable", package
    )
    stage.script("the add-on and its packages are those of the zip", TESTS / "check_installed.py")
    stage.run("its command answers", "--background", "--command", "grating", "--help")


def without_the_extension(stage: Stage, plane: Path, output: Path, bare: Path) -> None:
    """Render the file without the extension and with scripts off. In Cycles on the same processor it is the same
    picture."""
    alone = output / "without"
    alone.mkdir(exist_ok=True)
    options = ("--factory-startup", "-Y", plane, "--python-exit-code", "1", "--python", COMPARE)
    known = output / "CYCLES.exr"
    stage.run("the same without the extension", "--background", *options, "--", "CYCLES", alone, known, user=bare)


def press(stage: Stage, output: Path) -> None:
    """Press the panel's buttons with simulated events. This needs a screen of 1280 x 1800 pixels, which shows them
    all."""
    file = output / "unseen.blend"
    stage.script("an artist's file", TESTS / "make_unseen.py", file)
    events = ("--enable-event-simulate", "--window-geometry", "0", "0", "1280", "1800")
    bake = output / "bake" / "blazed.exr"
    stage.run("the panel's buttons", *events, file, "--python", TESTS / "press_buttons.py", "--", bake)


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    made.add_argument("zip", type=Path, metavar="ZIP", help="the extension for this system, as `./dev build` writes it")
    made.add_argument("--blender", required=True, metavar="PROGRAM", help="the Blender to test")
    made.add_argument("--output", required=True, type=Path, metavar="FOLDER", help="for pictures, files and the log")
    made.add_argument("--engines", nargs="+", choices=ENGINES, default=ENGINES, help="default: both")
    made.add_argument("--window", action="store_true", help="press the panel's buttons too, on a screen of 1280 x 1800")
    made.add_argument("--record", action="store_true", help="record the pictures' numbers instead of comparing them")
    return made


if __name__ == "__main__":
    main()
