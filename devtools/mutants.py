# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev mutants`: puts one fault at a time into a copy of the last commit, and runs tests until one of them fails."""

import re
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from . import ROOT, DevError
from .environments import PY311, PY313, Environment, require
from .steps import clean_environment, say

LIMIT_SECONDS = 15 * 60
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+?::\S+|\S+)", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """A fault: `old` in `file` becomes `new`. `tests` are run one after the other, paths below tests/."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    environment: Environment = PY311


@dataclass(frozen=True)
class Verdict:
    """The first test that fails, or "" for a survivor, and seconds of wall time until then."""

    mutant: Mutant
    test: str
    seconds: float


def named(words: Sequence[str]) -> list[Mutant]:
    """The mutants whose names contain one of the words; all without words. Raises DevError if there is none."""
    found = [mutant for mutant in MUTANTS if not words or any(word in mutant.name for word in words)]
    if not found:
        raise DevError(f"no mutant is named {' or '.join(words)}; remedy: ./dev mutants --list")
    return found


@contextmanager
def checkout() -> Iterator[Path]:
    """A worktree of the last commit, with the real scans beside it where this checkout has them."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as parent:
        folder = Path(parent, "main")
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--detach", "--quiet", str(folder), "HEAD"], check=True)
        if (ROOT.parent / "shared").is_dir():
            Path(parent, "shared").symlink_to(ROOT.parent / "shared")
        try:
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", str(folder)], check=True)


def text_with(mutant: Mutant, text: str) -> str:
    """The file's text with the fault. Raises DevError unless the old text occurs once."""
    if text.count(mutant.old) != 1:
        raise DevError(f"{mutant.file}: {mutant.name}: its text occurs {text.count(mutant.old)} times; remedy: move it")
    return text.replace(mutant.old, mutant.new)


def try_mutant(mutant: Mutant, folder: Path) -> Verdict:
    """Run the mutant's tests, with the cases of the short set, until the first failure."""
    path = folder / mutant.file
    sound = path.read_text()
    command = [str(mutant.environment.python), "-m", "pytest", "-x", "-q", "--short", "-p", "no:cacheprovider"]
    command += [f"tests/{test}" for test in mutant.tests]
    start = time.monotonic()
    path.write_text(text_with(mutant, sound))
    try:
        run = subprocess.run(
            command, cwd=folder, env=clean_environment(PYTHONPATH=str(folder), CI="true"), timeout=LIMIT_SECONDS,
            stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
        )  # fmt: skip
        output, status = run.stdout, run.returncode
    except subprocess.TimeoutExpired:
        output, status = "", 1
    finally:
        path.write_text(sound)
    failed = FAILED.search(output)
    test = "" if status == 0 else failed[1] if failed else f"exit status {status}"
    return Verdict(mutant, test, time.monotonic() - start)


def run(words: Sequence[str]) -> int:
    """Try the named mutants and print a line for each. Returns 0 if tests noticed all of them, else 1."""
    mutants = named(words)
    for environment in dict.fromkeys(mutant.environment for mutant in mutants):
        require(environment)
    survivors = 0
    with checkout() as folder:
        for mutant in mutants:
            say(mutant.name)
            verdict = try_mutant(mutant, folder)
            survivors += not verdict.test
            print(f"{verdict.seconds:6.1f} s  {mutant.name}: {verdict.test or 'SURVIVED'}", flush=True)
    print(f"\n{len(mutants) - survivors} of {len(mutants)} mutants noticed")
    return 1 if survivors else 0


MUTANTS = (
    Mutant(
        "brdf half-angle sign",
        "precompute/optics/brdf.py",
        "0.5 * (1 + dot(wi, wr))",
        "0.5 * (1 - dot(wi, wr))",
        (
            "precompute/optics",
            "precompute/bake/test_golden.py",
            "precompute/reference",
            "precompute/table",
            "precompute/measure",
            "precompute/maps",
        ),
    ),
    Mutant(
        "brdf Stam cos(tr)->cos(ti)",
        "precompute/optics/brdf.py",
        "np.maximum(wr[..., 2], 1e-6)",
        "np.maximum(wi[..., 2], 1e-6)",
        (
            "precompute/optics",
            "precompute/bake/test_golden.py",
            "precompute/reference",
            "precompute/table",
            "precompute/measure",
            "precompute/maps",
        ),
    ),
    Mutant(
        "coherence areas: sqrt 2 dropped",
        "precompute/optics/coherence.py",
        "shift = math.sqrt(2) * coherence_length_m / 4",
        "shift = coherence_length_m / 4",
        (
            "precompute/optics/test_coherence.py",
            "precompute/bake/test_golden.py",
            "precompute/optics",
            "precompute/cli",
            "precompute/bake",
        ),
    ),
    Mutant(
        "phasor: sign of sine",
        "precompute/spectra/spectrum.py",
        "np.cos(phase), -np.sin(phase)",
        "np.cos(phase), np.sin(phase)",
        (
            "precompute/bake/test_golden.py",
            "precompute/spectra",
            "precompute/reference",
            "precompute/methods",
            "precompute/bake/test_bake_against_reference.py",
        ),
    ),
    Mutant(
        "spectrum: guard 0.4 -> 0",
        "precompute/spectra/spectrum.py",
        "_GUARD = 0.4",
        "_GUARD = 0.0",
        (
            "precompute/bake/test_golden.py",
            "precompute/spectra",
            "precompute/bake/test_bake_against_reference.py",
            "precompute/bake/test_hard_cases.py",
            "precompute/reference",
        ),
    ),
    Mutant(
        "resample: reach in rows skipped",
        "precompute/spectra/resample.py",
        "past=reach, radius=radius)",
        "past=0.0, radius=radius)",
        (
            "precompute/bake/test_golden.py",
            "precompute/spectra",
            "precompute/reference",
            "precompute/bake/test_resampling.py",
            "precompute/bake/test_bake_against_reference.py",
        ),
    ),
    Mutant(
        "radiance: roughness factor 2 dropped",
        "precompute/table/radiance.py",
        "(w * skin.roughness**2) ** 2 / 2",
        "(w * skin.roughness**2) ** 2",
        (
            "precompute/laboratory/test_roughness.py",
            "precompute/table",
            "precompute/measure",
            "precompute/maps",
            "precompute/check",
        ),
    ),
    Mutant(
        "radiance: disc foreshortening",
        "precompute/table/radiance.py",
        "shortened = (1 + wi[..., 2] ** 2) / 2",
        "shortened = wi[..., 2] ** 2",
        (
            "render/test_radiance.py",
            "precompute/table",
            "precompute/measure",
            "precompute/maps",
            "precompute/check",
        ),
    ),
    Mutant(
        "bound: axes swapped",
        "precompute/table/albedo_bound.py",
        "return y * along + middle, x * along + middle",
        "return x * along + middle, y * along + middle",
        ("precompute/table", "precompute/bake/test_excess_albedo.py", "precompute/check", "precompute/maps"),
    ),
    Mutant(
        "tiles: rim 3 -> 1",
        "precompute/bake/tiles.py",
        "_RIM = 3",
        "_RIM = 1",
        (
            "precompute/bake/test_golden.py",
            "precompute/bake/test_reading.py",
            "precompute/bake/test_region.py",
            "precompute/bake/test_resampling.py",
            "precompute/bake/test_table_shape.py",
            "precompute/bake/test_bake_against_reference.py",
            "precompute/bake/test_hard_cases.py",
        ),
    ),
    Mutant(
        "kernel: held guard skipped",
        "precompute/bake/kernel.py",
        "min(coherence.longest_averaging_length(*extent(reliefs)), held)",
        "coherence.longest_averaging_length(*extent(reliefs))",
        (
            "precompute/bake/test_golden.py",
            "precompute/bake/test_plan.py",
            "precompute/bake/test_request.py",
            "precompute/bake/test_hard_cases.py",
            "precompute/bake/test_expected.py",
        ),
    ),
    Mutant(
        "lines: mean of steps kept",
        "precompute/surface/steps/lines.py",
        "np.nan_to_num(steps - np.nanmean(steps))",
        "np.nan_to_num(steps)",
        ("precompute/surface/steps", "precompute/surface"),
    ),
    Mutant(
        "rotate: sense of rows",
        "precompute/surface/steps/cutting.py",
        "row = (part * cos + x * sin)",
        "row = (part * cos - x * sin)",
        ("precompute/surface/steps", "precompute/surface"),
    ),
    Mutant(
        "crop: half pixel off",
        "precompute/surface/steps/cutting.py",
        "math.ceil(edge * 1e-6 / pixel - 0.5)",
        "math.ceil(edge * 1e-6 / pixel)",
        ("precompute/surface/steps", "precompute/surface"),
    ),
    Mutant(
        "dE00: sign of 6 degrees",
        "precompute/colour/difference.py",
        "np.cos(3 * h_mean + np.radians(6))",
        "np.cos(3 * h_mean - np.radians(6))",
        ("precompute/colour", "precompute/measure"),
    ),
    Mutant(
        "lamp row: variance 24 -> 12",
        "addon/lamps/lamp_properties.py",
        "{24 if lamp.shape in",
        "{12 if lamp.shape in",
        ("addon/cameras", "addon/lamps"),
        PY313,
    ),
    Mutant(
        "lamp index: 8 collides",
        "addon/lamps/lamp_properties.py",
        "index if index < _LAMPS_BEFORE else",
        "index if index <= _LAMPS_BEFORE else",
        ("addon/lamps", "addon/materials", "addon/workflow"),
        PY313,
    ),
    Mutant(
        "lamp group: far of sun and lamp swapped",
        "addon/lamps/lamp_group.py",
        "far = (1.0 - lamp.is_local)",
        "far = lamp.is_local",
        ("render/test_shadows.py", "addon/lamps", "addon/materials"),
        PY313,
    ),
    Mutant(
        "lamp group: y axis sign (cross)",
        "addon/lamps/lamp_group.py",
        "y = tree.cross(axis, lamp.x) * lamp.x_over_y",
        "y = tree.cross(axis, lamp.x)",
        ("render/test_lamps.py", "addon/lamps", "addon/materials"),
        PY313,
    ),
    Mutant(
        "direct: factor 4 -> 2",
        "addon/materials/direct/direct_group.py",
        "(view.cosine * 4.0)",
        "(view.cosine * 2.0)",
        ("render/test_plane.py", "addon/materials", "addon/nodes", "addon/sample_scenes"),
        PY313,
    ),
    Mutant(
        "direct: bitangent sign",
        "addon/materials/direct/direct_group.py",
        "b = tree.cross(n, t)",
        "b = tree.cross(t, n)",
        ("render/test_plane.py", "addon/materials", "addon/nodes"),
        PY313,
    ),
    Mutant(
        "footprint: cos/steep clamp",
        "addon/materials/footprint.py",
        "steep = 1.0 / tree.maximum(cosine, 0.05)",
        "steep = 1.0 / tree.maximum(cosine, 0.5)",
        ("render/test_footprint.py", "addon/materials", "addon/nodes"),
        PY313,
    ),
    Mutant(
        "varying: shares guard skipped",
        "addon/workflow/varying.py",
        "if sum(choice.shares) > 1.0 + 1e-6:",
        "if sum(choice.shares) > 2.0 + 1e-6:",
        ("addon/workflow/test_varying.py", "addon/batch", "addon/operators"),
        PY313,
    ),
    Mutant(
        "following: linked scenes not skipped",
        "addon/workflow/following_lamps.py",
        "        if scene.library is None:\n            update_lamps",
        "        if True:\n            update_lamps",
        (
            "addon/workflow/test_following_settings.py",
            "addon/lamps",
        ),
        PY313,
    ),
    Mutant(
        "batch render: resume guard",
        "addon/batch/render_command.py",
        "if not (arguments.resume and path.is_file())}",
        "if not arguments.resume}",
        ("addon/batch",),
        PY313,
    ),
    Mutant(
        "batch gratings: two of a name",
        "addon/batch/gratings.py",
        ".count(name) > 1",
        ".count(name) > 2",
        (
            "addon/batch/test_commands.py",
            "addon/batch",
        ),
        PY313,
    ),
)
