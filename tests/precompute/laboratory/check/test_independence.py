# SPDX-License-Identifier: GPL-3.0-or-later
"""`check` shares no code with the bake; tested in the syntax trees without importing anything."""

from devtools import ROOT
from devtools.changed import imports

OF_THE_BAKE = {"maths", "spectra", "table", "reference", "bake"}
# Everything that `check` shares with the bake: failures, memory and progress, the surface, directions, the observer,
# the error metrics, the reflectance of matters, the mapping of colours into a renderer's space.
SHARED = {
    "base/exr_reader.py", "base/failure.py", "base/files.py", "base/job.py", "base/locks.py", "base/machine.py",
    "base/progress.py", "base/strict.py", "colour/channels.py", "colour/illuminants.py", "colour/observer.py",
    "colour/spaces.py", "measure/errors.py", "measure/shown_colours.py", "optics/brdf.py", "optics/plate.py",
    "optics/region.py", "reflectance/films.py", "reflectance/matter.py", "surface/height_map.py",
    "surface/periods.py", "surface/relief.py", "surface/steps/pipeline.py", "surface/steps/repairs.py",
    "surface/steps/step.py",
}  # fmt: skip


def reached(path, found=()):
    """Sources that a file imports, directly or not, as paths from precompute; those of `check` as check/NAME."""
    found = set(found)
    for name in imports(path):
        # A name is a module, or something in one.
        for module in filter(None, (name, name.rpartition(".")[0])):
            target = ROOT.joinpath(*module.split("."))
            for each in (target.with_suffix(".py"), target / "__init__.py"):
                inside = each.relative_to(ROOT).as_posix().removeprefix("precompute/").removeprefix("laboratory/")
                if each.is_file() and inside not in found:
                    found = reached(each, found | {inside})
    return found


def rooms(paths):
    return {path.split("/")[0] for path in paths} - {"__init__.py"}


def test_it_shares_nothing_with_the_bake():
    shared = reached(ROOT / "laboratory" / "check" / "verdict.py")
    assert {path for path in shared if not path.startswith("check/") and not path.endswith("__init__.py")} == SHARED
    # The readers of height maps do not import the bake either; the last lines check that imports are found at all.
    assert not rooms(reached(ROOT / "precompute/surface/readers/reader_registry.py")) & OF_THE_BAKE
    assert OF_THE_BAKE - {"bake"} <= rooms(reached(ROOT / "precompute/bake/make.py"))
    assert "bake" in rooms(reached(ROOT / "precompute/cli/bake_verb.py"))
