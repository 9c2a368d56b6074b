# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the site's page of all commands, from the parsers that run them: `python -m devtools.docs.commands FILE`.

The program runs in a Blender, because many options of the verbs there are properties of operators."""

import contextlib
import io
import os
import re
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from laboratory.verbs import PACKAGES
from precompute.cli.parser import OneLineParser, build_parser

from .. import EXTENSION
from ..extension import AddonModules, link_extension


def page(addon: AddonModules) -> str:
    """The page in Markdown: a section for each verb with the text that `--help` prints."""
    texts = {verb: text for verbs in PACKAGES.values() for verb, text in verbs.items()}
    parts = ["# Commands", "[Examples](batch.md). Each section is what `VERB --help` prints."]
    parts += ["## Without Blender", *_sections("./dev grating", texts, lambda argv: build_parser(argv, PACKAGES))]
    commands = addon.commands
    parts += ["## In Blender", *_sections("blender --command grating", commands.VERBS, commands.build_parser)]
    return "\n\n".join(parts) + "\n"


def _sections(program: str, verbs: Mapping[str, object], parser_of: Callable[[list[str]], OneLineParser]) -> list[str]:
    return [f"### {program} {verb}\n\n```\n{_help(parser_of([verb]), verb)}```" for verb in sorted(verbs)]


def _help(parser: OneLineParser, *words: str) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as printed, contextlib.suppress(SystemExit):
        parser.parse_args([*words, "--help"])
    text = printed.getvalue()
    inner = re.search(r" ([a-z|]+) \.\.\.$", text, re.MULTILINE)  # verbs of a verb: list|prune|verify
    return "\n".join([text, *(_help(parser, *words, word) for word in inner[1].split("|"))]) if inner else text


def main() -> None:
    """Write the page to the file that the command line names."""
    os.environ |= {"COLUMNS": "88", "LC_ALL": "C"}  # which argparse reads
    with tempfile.TemporaryDirectory() as user_folder:
        os.environ["BLENDER_USER_RESOURCES"] = user_folder
        link_extension(Path(user_folder))
        import bpy  # which reads the user folder

        bpy.ops.preferences.addon_enable(module=EXTENSION)
        Path(sys.argv[1]).write_text(page(AddonModules(EXTENSION)), encoding="utf-8")


if __name__ == "__main__":
    main()
