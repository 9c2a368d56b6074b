# SPDX-License-Identifier: GPL-3.0-or-later
"""The faults of `./dev mutants`. Where the code moves, its fault moves along."""

from dataclasses import dataclass

from .environments import PY311, PY313, Environment


@dataclass(frozen=True)
class Mutant:
    """A fault: `old` in `file` becomes `new`. `tests` are run one after the other, paths below tests/."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    environment: Environment = PY311


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
