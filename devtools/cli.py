# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of ./dev."""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from . import ROOT, DevError, blender, chroot, environments, machine, mutants, packages, release, suites
from .docs import site
from .environments import ALL, BPY45, DOCS, LINT, Environment
from .steps import become, clean_environment, project_environment
from .window import walk

PACKAGE = "natural_gratings"  # the name under which mypy knows this folder; pyproject.toml uses it too

VERBS_HELP = """\
verbs:
  demo [--output DIR]     the main job: bakes a scan, maps it and renders it on a snake, with a report
  scenes [--output DIR]   writes the sample scenes as .blend files, with pictures
  test [PYTEST ARGS]      runs every test that CI runs; --all adds those of the night; a path under tests/ chooses
  mutants [NAME ...]      puts single faults into a copy, and lists those that no test notices
  lint [--fix]            checks rules and formatting with ruff, types with mypy
  docs [--output DIR]     builds the pages of docs/ as a site, and checks them
  bench [ARGS]            runs the benchmarks of laboratory/benchmarks/
  build [--output DIR]    builds and validates the extension's zip for each platform
  release [--output DIR]  builds the zips with checksums, notes and Blender's index; --tag tags the commit
  grating ARGS            runs the command line without Blender: info, bake, map, ...
  blender ARGS            runs Blender with this working tree as its extension
  walk [--output DIR]     presses the panel's buttons in a Blender with a window, and saves pictures
  blender-setup           installs a real Blender into .env, on Debian
  env                     lists the interpreters, environments, libraries and Blenders on this machine

`./dev VERB --help` gives details. The first use of a verb makes the environment that it needs, under .env.
"""


def chosen(options: argparse.Namespace) -> Environment:
    """The environment for --bpy; by default that of Blender 4.5."""
    return next((one for one in ALL if one.blender_version == options.bpy), BPY45)


def verb_parser(verb: str, description: str) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(prog=f"./dev {verb}", description=description)


def demo(options: argparse.Namespace, arguments: list[str]) -> NoReturn:
    _run_scenes("demo", "Bakes the sample grating, renders it on a snake and writes a report.", options, arguments)


def scenes(options: argparse.Namespace, arguments: list[str]) -> NoReturn:
    _run_scenes("scenes", "Writes the sample scenes as .blend files, and renders them.", options, arguments)


def _run_scenes(verb: str, description: str, options: argparse.Namespace, arguments: list[str]) -> NoReturn:
    """Replace this process by the verb's module of sample_scenes, with the Blender that was asked for."""
    parser = verb_parser(verb, description)
    parser.add_argument("--output", type=Path, default=ROOT / "dist" / verb, help=f"default: dist/{verb}")
    own, rest = parser.parse_known_args(arguments)
    machine.ensure_blender_libraries()
    environment = environments.require(chosen(options))
    command = ["-m", f"sample_scenes.{verb}", "--output", own.output.absolute(), *rest]
    if options.blender:
        command += ["--blender", blender.require_binary(options.blender)]
    elif options.bpy:
        command += ["--bpy", options.bpy]
    os.chdir(ROOT)
    become([environment.python, *command], project_environment())


def test(options: argparse.Namespace, arguments: list[str]) -> int:
    if {"-h", "--help"} & set(arguments):
        print("usage: ./dev [--bpy 4.5|5.2|5.3] test [--all | --changed | PATH ...] [--clock] [PYTEST OPTIONS]")
        print("Without --all and paths: the short set, which CI runs. A path runs all of its tests.")
        print("--changed: the rooms that differ from the last commit, and those that import them, in one Blender.")
        print("--clock writes seconds of each test and phase into .env/reports/SUITE.clock, a JSON object a line.")
        print("--shuffle SEED runs the files of each suite in a random order.")
        print("Suites, each in each environment it is for: " + ", ".join(suites.FOLDERS))
        return 0
    binary = blender.require_binary(options.blender) if options.blender else blender.find_binary()
    machine.ensure_blender_libraries()
    found = environments.ensure(*([chosen(options)] if options.bpy else ALL))
    return suites.run(found, arguments, binary)


def try_mutants(_: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("mutants", "Puts one fault at a time into a copy of the last commit, and runs its tests.")
    parser.add_argument("name", nargs="*", help="a part of a mutant's name; default: all")
    parser.add_argument("--list", action="store_true", help="list the mutants, and run none")
    own = parser.parse_args(arguments)
    if own.list:
        print("\n".join(mutant.name for mutant in mutants.named(own.name)))
        return 0
    return mutants.run(own.name)


def lint(_: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("lint", "Checks rules and formatting with ruff, and types with mypy.")
    parser.add_argument("--fix", action="store_true", help="fix what ruff can fix, and format")
    fix = parser.parse_args(arguments).fix
    environment = environments.require(LINT)
    commands = (
        [["check", "--fix"], ["format"]]
        if fix
        else [["check", "--output-format=concise"], ["format", "--check", "--output-format=concise"]]
    )
    ruff = [environment.python, "-m", "ruff"]
    settings = {"cwd": ROOT, "env": clean_environment()}
    statuses = [subprocess.run([*ruff, *command, "."], **settings).returncode for command in commands]
    return max(*statuses, _check_types(environment))


def _check_types(environment: Environment) -> int:
    """Run mypy over the packages that ship. Returns its exit status.

    The add-on imports precompute relative to the repository's folder, so mypy needs that folder as a package. Its name
    may not be a valid package name, so a link provides one."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, PACKAGE).symlink_to(ROOT, target_is_directory=True)
        command = [environment.python, "-m", "mypy", "--config-file", ROOT / "pyproject.toml"]
        command += ["--cache-dir", environments.ENVIRONMENTS / "mypy"]
        for package in ("precompute", "addon"):
            command += ["--package", f"{PACKAGE}.{package}"]
        settings = {"cwd": folder, "env": clean_environment(MYPYPATH=folder)}
        found = subprocess.run(command, stdout=subprocess.PIPE, text=True, **settings)
    print(found.stdout.replace(f"{PACKAGE}/", ""), end="", flush=True)
    return found.returncode


def make_docs(_: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("docs", "Builds the pages of docs/ as a site, and checks the pages. Prints a line per fault.")
    parser.add_argument("--output", type=Path, default=ROOT / "dist" / "docs", help="default: dist/docs")
    parser.add_argument("--external", action="store_true", help="also fetch the links into the web")
    own = parser.parse_args(arguments)
    output = own.output.absolute()
    faults = site.build(environments.require(DOCS), output, external=own.external)
    print("\n".join([*faults, f"{output / 'index.html'} ({site.megabytes(output):.1f} MB)"]))
    return 1 if faults else 0


def bench(options: argparse.Namespace, arguments: list[str]) -> NoReturn:
    machine.ensure_blender_libraries()
    environment = environments.require(chosen(options))
    os.chdir(ROOT)
    become([environment.python, "-m", "laboratory.benchmarks", *arguments], project_environment())


def build(_: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("build", "Builds the extension's zip for each platform and validates each.")
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="default: dist")
    parser.add_argument("--lock", action="store_true", help="record the wheels' hashes instead of checking them")
    own = parser.parse_args(arguments)
    for package in packages.build(environments.require(BPY45), own.output, own.lock):
        print(f"{package} ({package.stat().st_size / 1e6:.1f} MB)")
    return 0


def make_release(_: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("release", "Builds a release from a clean tree: zips, checksums, notes, and Blender's index.")
    default = ROOT / "dist" / packages.manifest()["version"]
    parser.add_argument("--output", type=Path, default=default, help="new folder; default: dist/VERSION")
    parser.add_argument("--website", metavar="URL", default="", help="website in the zips' manifests")
    parser.add_argument("--tag", action="store_true", help="tag the commit as vVERSION; nothing is pushed")
    own = parser.parse_args(arguments)
    if own.website and not own.website.startswith("https://"):
        raise DevError(f"--website {own.website}: is no address; remedy: begin it with https://")
    environment = environments.require(BPY45)
    for path in release.release(environment, own.output.absolute(), website=own.website, tag=own.tag):
        print(f"{path} ({path.stat().st_size / 1e6:.1f} MB)" if path.suffix == ".zip" else path)
    return 0


def grating(_: argparse.Namespace, arguments: list[str]) -> NoReturn:
    environment = environments.require(BPY45)
    own = {path.stem.removesuffix("_verb") for path in (ROOT / "laboratory" / "verbs").glob("[a-z]*.py")}
    # The laboratory's program lists the verbs of both.
    package = "laboratory" if not arguments or arguments[0] in {*own, "-h", "--help"} else "precompute"
    # The working folder stays the caller's, so relative paths keep their meaning.
    become([environment.python, "-m", package, *arguments], project_environment())


def run_blender(options: argparse.Namespace, arguments: list[str]) -> NoReturn:
    if options.blender:
        binary = blender.require_binary(options.blender)
    else:
        binary = None if options.bpy else blender.find_binary()
    if binary:
        blender.launch_binary(binary, arguments).run()
    blender.launch_shim(chosen(options), arguments).run()


def take_walk(options: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("walk", "Presses the panel's buttons in a Blender with a window and takes pictures of it.")
    parser.add_argument("--output", type=Path, help="default: dist/walk; of the pages' pictures, the pages' folder")
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--first-hour", action="store_true", help="an artist's first hour with the installed package")
    kinds.add_argument("--screens", action="store_true", help="the pages' pictures of the panel")
    kinds.add_argument("--film", action="store_true", help="the pages' film of Show Me")
    own = parser.parse_args(arguments)
    binary = blender.require_binary(options.blender) if options.blender else blender.find_binary()
    if binary is None:
        raise DevError("no Blender with a window; remedy: ./dev blender-setup on Debian, or --blender PATH")
    take, output = walk.walk, ROOT / "dist" / "walk"
    if own.first_hour:
        take = walk.first_hour
    elif own.screens:
        take, output = walk.screens, ROOT / "docs" / "images" / "screens"
    elif own.film:
        take, output = walk.film, ROOT / "docs" / "images"
    for picture in take(binary, (own.output or output).absolute()):
        print(picture)
    return 0


def blender_setup(_: argparse.Namespace, arguments: list[str]) -> int:
    parser = verb_parser("blender-setup", "Puts Debian sid with its Blender into .env/sid, by debootstrap.")
    parser.parse_args(arguments)
    print(chroot.set_up())
    return 0


def describe_environments(_: argparse.Namespace, arguments: list[str]) -> int:
    verb_parser("env", "Lists what is installed, and makes nothing.").parse_args(arguments)
    for environment in (*ALL, LINT, DOCS):
        state = "ready" if environments.is_ready(environment) else "not made"
        purpose = (
            f"Blender {environment.blender_version}" if environment.blender_version else f"./dev {environment.name}"
        )
        base = next(machine.runnable_pythons(environment.python_version), "no interpreter")
        print(f"{environment.name}: {state}, {purpose}, {base}")
    missing = machine.missing_blender_libraries()
    print("system libraries: " + (f"missing: {', '.join(missing)}" if missing else "all there"))
    binary = blender.find_binary()
    print(f"blender binary: {binary or 'none; ./dev blender-setup brings one on Debian'}")
    return 0


VERBS: dict[str, Callable[[argparse.Namespace, list[str]], int]] = {
    "demo": demo,
    "scenes": scenes,
    "test": test,
    "mutants": try_mutants,
    "lint": lint,
    "docs": make_docs,
    "bench": bench,
    "build": build,
    "release": make_release,
    "grating": grating,
    "blender": run_blender,
    "walk": take_walk,
    "blender-setup": blender_setup,
    "env": describe_environments,
}


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="./dev", epilog=VERBS_HELP, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    versions = [environment.blender_version for environment in ALL]
    parser.add_argument("--bpy", choices=versions, help="use the bpy wheel of this Blender")
    parser.add_argument("--blender", metavar="PATH", help="use this Blender binary")
    parser.add_argument("verb", choices=VERBS, metavar="VERB", help="one of the verbs below")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb. Returns the exit status of the program that it ran, or 1 after printing a one-line error."""
    parser = make_parser()
    arguments = sys.argv[1:] if arguments is None else arguments
    if not arguments:
        parser.print_help(sys.stderr)
        return 2
    options = parser.parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        status = VERBS[options.verb](options, options.arguments)
        return status if status >= 0 else 128 - status  # as a shell reports a signal
    except DevError as fault:
        print(f"error: {fault}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
