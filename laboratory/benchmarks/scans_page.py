# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/scans.md."""

from precompute.surface.steps.pipeline import KINDS

from . import report

TITLES = {"elaphe": "Elaphe guttata", "xenopeltis": "Xenopeltis unicolor"}

STEPS = """
| step | what it does |
|---|---|
"""
ROWS = """
| skin | steps | removed | relief | terms | MiB in Blender | dE00 mean | dE00 p99 | light that moves | own p99 |
|---|---|---|---|---|---|---|---|---|---|
"""


def row_of(row: dict) -> str:
    """A line of figures, its cells parted as in the table."""
    same = row["p99"] < 0.005  # the plain bake beside itself, but for rounding
    return " | ".join((
        f"`{row['steps']}`",
        f"{row['removed']:.2%}",
        f"{row['height_range_m'] * 1e9:.0f} nm, rms {row['rms_m'] * 1e9:.1f}",
        f"{row['terms']}",
        f"{row['blender_bytes'] / 2**20:.0f}",
        "-" if same else f"{row['mean']:.2f}",
        "-" if same else f"{row['p99']:.2f}",
        "-" if same else f"{row['relative_dy']:.1%}",
        f"{row['own_p99']:.2f}",
    ))  # fmt: skip


def page(skins: list[dict], delta_e: float) -> str:
    """The whole page."""
    steps = "".join(f"| `{kind.form.replace('|', ' or ')}` | {kind.help} |\n" for kind in KINDS.values())
    rows = "".join(f"| {TITLES[skin['name']]} | {row_of(row)} |\n" for skin in skins for row in skin["rows"])
    figures = {"steps": STEPS + steps, "delta_e": f"{delta_e:g}", "skins": ROWS + rows + "".join(map(_section, skins))}
    return report.filled("scans.md", figures)


def _section(skin: dict) -> str:
    plain, *repaired = skin["rows"]
    told = "\n".join(f"    {line}" for line in dict.fromkeys(line for row in repaired for line in row["told"]))
    shown = "heights as scanned, what is removed, heights as filled, the maps of both bakes"
    quality = "\n".join(f"    {line}" for line in skin["quality"])
    return "\n".join((
        f"\n### {TITLES[skin['name']]}\n",
        f"![From left to right: {shown}](images/scans/{skin['name']}.png)\n",
        "What `info` reports, and what the steps report:\n",
        f"{quality}\n\n{told}\n",
        f"{_saved(plain, repaired)}\n",
    ))  # fmt: skip


def _saved(plain: dict, repaired: list[dict]) -> str:
    """A sentence on the terms that each repair saves."""
    parts = (
        f"`{row['steps']}` saves {saved} of {plain['terms']} terms"
        if (saved := plain["terms"] - row["terms"])
        else f"`{row['steps']}` still needs {plain['terms']} terms"
        for row in repaired
    )
    return "; ".join(parts) + "."
