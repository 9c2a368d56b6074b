# SPDX-License-Identifier: GPL-3.0-or-later
"""The process in which card.py renders files: its argument is a Job as JSON, and it prints a line for each file."""

import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

MARK = "card "


@dataclass(frozen=True)
class Job:
    """What to render: files, the picture's size, numbers of samples, where to put the pictures, and how often to time
    each, of which the shortest counts. `device` is EEVEE, CPU, or a kind of card as Cycles names it; `backend` is
    EEVEE's."""

    device: str
    files: list[str]
    size: tuple[int, int]
    samples: list[int]
    output: str
    repeat: int
    backend: str = "OPENGL"

    @property
    def eevee(self) -> bool:
        """Whether EEVEE renders."""
        return self.device == "EEVEE"

    def as_text(self) -> str:
        """The argument of the process."""
        return json.dumps(asdict(self))


def picture_of(output: Path, file: Path, device: str, samples: int) -> Path:
    """Where the picture of a file is."""
    return output / f"{file.parent.name}_{file.stem}_{device.lower()}_{samples}.exr"


def render_files(job: Job) -> None:
    """Render the files, and print the facts of each as soon as they are known."""
    import bpy

    bpy.context.preferences.system.gpu_backend = job.backend
    for file in job.files:
        start = time.perf_counter()
        bpy.ops.wm.open_mainfile(filepath=file)
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = job.size
        name = "" if job.eevee else _choose(scene, job.device)
        _render(scene, 1)
        facts = {"file": file, "first": time.perf_counter() - start}
        facts["card"] = _renderer() if job.eevee else name
        facts["again"] = _render(scene, 1)
        facts["seconds"] = {}
        for samples in job.samples:
            facts["seconds"][samples] = min(_render(scene, samples) for _ in range(job.repeat))
            _save(scene, picture_of(Path(job.output), Path(file), job.device, samples))
        print(MARK + json.dumps(facts), flush=True)


def _choose(scene, device: str) -> str:
    """Let Cycles render on the processor, or on all cards of a kind; returns their names."""
    import bpy

    scene.render.engine, scene.cycles.shading_system, scene.cycles.seed = "CYCLES", False, 0
    scene.cycles.device = "CPU" if device == "CPU" else "GPU"
    if device == "CPU":
        return "processor"
    preferences = bpy.context.preferences.addons["cycles"].preferences
    preferences.compute_device_type = device
    preferences.get_devices()
    for each in preferences.devices:
        each.use = each.type == device
    names = [each.name for each in preferences.devices if each.use]
    if not names:
        sys.exit(f"error: Cycles finds no card by {device}")
    return ", ".join(names)


def _renderer() -> str:
    """What EEVEE draws with; known after its first picture."""
    import gpu

    return f"{gpu.platform.renderer_get()}, {gpu.platform.version_get()}, {gpu.platform.backend_type_get()}"


def _render(scene, samples: int) -> float:
    """Seconds of a picture, without writing it to a file."""
    import bpy

    scene.cycles.samples = scene.eevee.taa_render_samples = samples
    start = time.perf_counter()
    bpy.ops.render.render()
    return time.perf_counter() - start


def _save(scene, path: Path) -> None:
    import bpy

    image = scene.render.image_settings
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR", "32", "ZIP"
    bpy.data.images["Render Result"].save_render(str(path), scene=scene)


if __name__ == "__main__":
    render_files(Job(**json.loads(sys.argv[1])))
