# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev grating VERB` starts the program that has the verb."""

from argparse import Namespace
from types import SimpleNamespace

import pytest

from devtools import cli


@pytest.mark.parametrize(
    ("verb", "package"),
    [("evaluate", "laboratory"), ("efficiency", "laboratory"), ("benchmark", "laboratory"), ("--help", "laboratory"),
     ("check", "laboratory"), ("bake", "precompute")],
)  # fmt: skip
def test_a_verb_of_the_laboratory_starts_the_laboratory(verb, package, monkeypatch):
    started = []
    monkeypatch.setattr(cli, "become", lambda command, *_: started.extend(command))
    monkeypatch.setattr(cli.environments, "require", lambda _: SimpleNamespace(python="python"))
    cli.grating(Namespace(), [verb])
    assert started == ["python", "-m", package, verb]
