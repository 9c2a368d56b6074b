# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the pictures of a folder as a film that repeats for ever: `film.py FOLDER FILM`, with Pillow."""

import sys
from pathlib import Path

from PIL import Image

FRAME_MS, LAST_MS, WIDTH = 100, 1000, 720


def main(folder: Path, film: Path) -> None:
    """Write the film: WebP, 720 pixels wide, 10 frames a second, the last for a second."""
    frames = []
    for path in sorted(folder.glob("*.png")):
        with Image.open(path) as picture:
            size = WIDTH, round(picture.height * WIDTH / picture.width)
            frames.append(picture.convert("RGB").resize(size, Image.Resampling.LANCZOS))
    durations = [FRAME_MS] * (len(frames) - 1) + [LAST_MS]
    frames[0].save(film, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=60, method=6)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
