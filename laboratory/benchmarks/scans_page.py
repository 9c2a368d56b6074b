# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/scans.md. The sentences stand in the page itself."""

from precompute.surface.steps.pipeline import KINDS

from ..study.pages import filled, table

TITLES = {"elaphe": "Elaphe guttata", "xenopeltis": "Xenopeltis unicolor"}
HEAD = ["skin", "steps", "removed", "relief", "terms", "MiB in Blender", "dE00 mean", "dE00 p99", "light that moves"]


def cells_of(row: dict) -> list[str]:
    """The figures of a bake as cells of the table."""
    same = row["p99"] < 0.005  # the plain bake beside itself, but for rounding
    return [
        f"`{row['steps']}`",
        f"{row['removed']:.2%}",
        f"{row['height_range_m'] * 1e9:.0f} nm, rms {row['rms_m'] * 1e9:.1f}",
        f"{row['terms']}",
        f"{row['blender_bytes'] / 2**20:.0f}",
        "-" if same else f"{row['mean']:.2f}",
        "-" if same else f"{row['p99']:.2f}",
        "-" if same else f"{row['relative_dy']:.1%}",
        f"{row['own_p99']:.2f}",
    ]  # fmt: skip


def page(skins: list[dict], delta_e: float) -> str:
    """The whole page."""
    steps = [[f"`{kind.form.replace('|', ' or ')}`", kind.help] for kind in KINDS.values()]
    rows = [[TITLES[skin["name"]], *cells_of(row)] for skin in skins for row in skin["rows"]]
    figures = {"steps": table(["step", "what it does"], steps), "delta_e": f"{delta_e:g}"}
    figures["skins"] = table([*HEAD, "own p99"], rows)
    return filled("scans.md", figures | {f"reports of {skin['name']}": _reports(skin) for skin in skins})


def _reports(skin: dict) -> str:
    """The lines of `info`, and those of the steps of every repair."""
    told = dict.fromkeys(line for row in skin["rows"][1:] for line in row["told"])
    return "\n".join(("```", *skin["quality"], "", *told, "```"))
