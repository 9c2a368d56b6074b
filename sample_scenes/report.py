# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's one-page report."""

import os
from pathlib import Path


def write_report(output: Path, results: list[dict], seconds: dict[str, float], machine: str) -> Path:
    """Write report.md into `output` and return its path."""
    lines = ["# Natural Gratings: from scan to snake", "", f"Made by `./dev demo` on {machine}.", ""]
    for result in results:
        lines += section(output, result)
    lines += ["## Time", "", "| step | seconds |", "|---|---|"]
    lines += [f"| {step} | {value:.1f} |" for step, value in seconds.items()]
    path = output / "report.md"
    path.write_text("\n".join(lines) + "\n")
    return path


def section(output: Path, result: dict) -> list[str]:
    """The report's lines on one height map: measurements and pictures."""
    info, bake = result["info"], result["bake"]
    error = bake["delta_e"]
    dy, dx = info["pixel_size_m"]
    size = f"{info['cols'] * dx * 1e6:.1f} x {info['rows'] * dy * 1e6:.1f} um"
    period = f"{info['periods_m'][0] * 1e9:.0f} nm at {info['period_angles_deg'][0]:.1f} degrees"
    facts = {
        "Scan": f"{info['cols']} x {info['rows']} pixels, {size}",
        "Relief": f"{info['height_range_m'] * 1e9:.0f} nm, rms {info['height_rms_m'] * 1e9:.1f} nm",
        "Strongest period": period,
        "Coherence length": f"{bake['coherence_um']:.1f} um (at 550 nm)",
        "Table": f"{bake['tiles']} tiles of {bake['tile'][1]} x {bake['tile'][0]}, "
        f"{bake['blender_bytes'] / 2**20:.0f} MiB in Blender",
        "Colour error (dE00)": f"mean {error['mean']:.2f}, p95 {error['p95']:.2f}, p99 {error['p99']:.2f}, "
        f"max {error['max']:.2f} on {error['pairs']} direction pairs that the bake was not made from",
        "Energy error": f"sum of absolute dY over sum of Y: {error['relative_dy']:.2%}",
        "Bake": f"{bake['seconds']:.1f} s, self-check {bake['check_seconds']:.1f} s",
    }
    lines = [f"## {result['title']}", "", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in facts.items()]
    pictures = {"BRDF map, light at the normal": result["folder"] / "brdf_map.png", **result["pictures"]}
    for title, picture in pictures.items():
        relative = Path(os.path.relpath(picture, output)).as_posix()
        lines += ["", f"{title}:", "", f"![{title}]({relative})"]
    return [*lines, ""]
