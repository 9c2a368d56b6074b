# SPDX-License-Identifier: GPL-3.0-or-later
"""For every suite: Blender never sees the user's own set-up; `extension` is this tree as Blender loads it."""

import os
import shutil
import sys
import tempfile
from importlib.machinery import PathFinder
from pathlib import Path
from types import ModuleType

import pytest

from devtools import EXTENSION
from devtools.extension import AddonModules, link_extension

# Before any test module imports NumPy: the tests' matrix products are small, two suites run at once, and threads would
# wait for each other (test_efficiency.py: 12 s with one, 105 s with two on two busy cores).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Before any test module imports bpy.
USER_FOLDER = Path(tempfile.mkdtemp(prefix="natural-gratings-tests-"))
os.environ["BLENDER_USER_RESOURCES"] = str(USER_FOLDER)
os.environ["NATURAL_GRATINGS_CACHE"] = str(USER_FOLDER / "cache")


# The exit status of the tests.
_ended_with = pytest.StashKey[int]()


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    session.config.stash[_ended_with] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """A process with Blender in it ends here, when all is written: at exit, Blender 4.5 may wait for ever for a thread
    that closes its sound device."""
    shutil.rmtree(USER_FOLDER, ignore_errors=True)
    if "bpy" in sys.modules and _ended_with in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[_ended_with])


@pytest.fixture(scope="session")
def extension() -> ModuleType:
    """The working tree, enabled as bl_ext.user_default.natural_gratings of an empty user folder."""
    from devtools.blender_shim import show_hidden_packages

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
def shared_data() -> Path:
    """Real scans, which may not be committed: beside the repository, or nowhere."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no real scans: ../shared/data is not beside the project")
    return folder


@pytest.fixture(scope="session")
def matplotlib() -> None:
    """For tests that plot. As in precompute/plots.py, a stand-in of colour-science does not count."""
    if PathFinder.find_spec("matplotlib") is None:
        pytest.skip("plots need matplotlib, a development dependency")
