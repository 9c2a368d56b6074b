# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for all suites. Blender starts with an empty user folder, and `extension` is this tree as Blender loads
it."""

import os
import random
import shutil
import sys
import tempfile
from importlib.machinery import PathFinder
from pathlib import Path
from types import ModuleType

import pytest

from devtools import EXTENSION
from devtools.extension import AddonModules, link_extension, unpack_extension

from .kept_groups import KeptGroups

# Set before any test module imports NumPy. Two suites run at once with small matrix products, so threads would wait for
# each other (test_efficiency.py: 12 s with one thread, 105 s with two, on two busy cores).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Set before any test module imports bpy.
USER_FOLDER = Path(tempfile.mkdtemp(prefix="natural-gratings-tests-"))
os.environ["BLENDER_USER_RESOURCES"] = str(USER_FOLDER)
os.environ["NATURAL_GRATINGS_CACHE"] = str(USER_FOLDER / "cache")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--short", action="store_true", help="leave out the tests and cases of the night")
    parser.addoption("--shuffle", type=int, metavar="SEED", help="run the files in a random order")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Shuffle the files, if asked. In a short run, leave out what is marked `night`, and of a test marked `short` the
    cases that it does not name."""
    if (seed := config.getoption("--shuffle")) is not None:
        files = sorted({item.path for item in items})
        random.Random(seed).shuffle(files)
        items.sort(key=lambda item: files.index(item.path))
    if not config.getoption("--short"):
        return
    late = [item for item in items if is_for_the_night(item)]
    config.hook.pytest_deselected(items=late)
    items[:] = [item for item in items if item not in set(late)]


def is_for_the_night(item: pytest.Item) -> bool:
    """Whether a short run leaves the test or its case out."""
    kept = item.get_closest_marker("short")
    return item.get_closest_marker("night") is not None or (
        kept is not None and not any(part in item.name for part in kept.args)
    )


# The exit status of the tests.
_ended_with = pytest.StashKey[int]()


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    session.config.stash[_ended_with] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """End a process that has loaded Blender: at exit, Blender 4.5 may wait for ever for the thread that closes its
    sound device."""
    shutil.rmtree(USER_FOLDER, ignore_errors=True)
    if "bpy" in sys.modules and _ended_with in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[_ended_with])


@pytest.fixture(scope="session")
def extension() -> ModuleType:
    """The working tree, enabled as bl_ext.user_default.natural_gratings in an empty user folder; or the zip that
    $NATURAL_GRATINGS_ZIP names, so that any test of the add-on can try a package."""
    from devtools.blender_shim import show_hidden_packages

    if package := os.environ.get("NATURAL_GRATINGS_ZIP"):
        unpack_extension(Path(package), USER_FOLDER)
    else:
        link_extension(USER_FOLDER)
    show_hidden_packages()
    import addon_utils

    module = addon_utils.enable(EXTENSION, default_set=True)
    assert module is not None, "the add-on cannot be enabled: its traceback is above"
    return module


@pytest.fixture
def addon(extension: ModuleType) -> AddonModules:
    """The add-on's modules by their files' names."""
    return AddonModules(extension.__name__)


@pytest.fixture(scope="session")
def kept_groups(tmp_path_factory):
    """The node groups of bakes that this session has built."""
    return KeptGroups(tmp_path_factory.mktemp("groups"))


@pytest.fixture(autouse=True)
def _bakes_groups_are_kept(request, monkeypatch):
    """In suites inside Blender, read the groups of a bake instead of building them again."""
    if {"scene", "stage"} & set(request.fixturenames):
        addon, kept = request.getfixturevalue("addon"), request.getfixturevalue("kept_groups")
        module = addon.direct_response
        for name, result in (
            ("build_direct_group", addon.response.Response),
            ("build_world_group", lambda group: group),
        ):
            monkeypatch.setattr(module, name, kept.around(getattr(module, name), result))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real scans beside the repository, which are not committed; skips the test if it is missing."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no real scans: ../shared/data is not beside the project")
    return folder


@pytest.fixture(scope="session")
def matplotlib() -> None:
    """Skip the test without matplotlib. A stand-in of colour-science does not count (laboratory/study/plots.py)."""
    if PathFinder.find_spec("matplotlib") is None:
        pytest.skip("plots need matplotlib, a development dependency")
