# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the draft bakes of the presets that the packages ship, in drafts/. Bakes of an earlier run come from the cache.

`./dev build` runs it; `python -m devtools.make_drafts [--preset cd]`."""

import sys

from precompute.bake import cache
from precompute.cli.parser import OneLineParser
from precompute.presets.presets import DRAFTS, draft_request, preset_names, read_preset, shipped_draft, write_draft


def main(argv: list[str] | None = None) -> int:
    """Make the drafts that are missing or outdated. Returns the exit status."""
    parser = OneLineParser(prog="devtools.make_drafts", description=__doc__.splitlines()[0])
    parser.add_argument("--preset", action="append", choices=preset_names(), help="which; default all")
    for name in parser.parse_args(argv).preset or preset_names():
        request = draft_request(read_preset(name).request)
        if shipped_draft(name, request) is None:
            height_maps = [scan.read() for scan in request.scans]
            write_draft(request, cache.cached_bake(height_maps, request, DRAFTS / name))
        print(name, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
