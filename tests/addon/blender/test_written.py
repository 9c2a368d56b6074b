# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender writes on a full disk, for which a limit on the size of files stands: a line of error, and the file that
was there stays. Blender itself reports success of a picture and of a small compressed .blend."""

import contextlib
import sys

import bpy
import numpy as np
import pytest

resource = pytest.importorskip("resource", reason="this system has no limit of a file's size")


@contextlib.contextmanager
def full_disk(most_bytes):
    before, keeps_bytecode = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # Python 3.13.0 leaves a cut .pyc of what is imported meanwhile
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, before[1]))
    try:
        yield
    finally:
        sys.dont_write_bytecode = keeps_bytecode
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def writers(addon, scene, tmp_path):
    """Each kind of file, with a function that writes it by a path."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    image = bpy.data.images.new("noise", 64, 64, float_buffer=True)
    image.pixels.foreach_set(np.random.default_rng(0).random(64 * 64 * 4, np.float32))
    kept, rendering = scene.render.resolution_percentage, addon.rendering_pictures
    yield {
        "a.blend": lambda path: addon.written.save_copy(path, compress=True),
        "a.exr": lambda path: rendering.render_picture(path, engine="cycles", samples=1, width=64, height=48),
        "a.png": lambda path: rendering.render_picture(path, width=64, height=48),
        "map.exr": lambda path: addon.combing.write_map(image, path),
    }
    scene.render.resolution_percentage = kept


def test_a_cut_file_is_an_error_and_the_former_file_stays(addon, writers, tmp_path):
    for name, write in writers.items():
        path = tmp_path / name
        path.write_bytes(b"former")
        with (
            full_disk(300),
            pytest.raises(addon.picture_setup.GratingError, match=f"^{path}: cannot be written .*space left there$"),
        ):
            write(path)
        assert path.read_bytes() == b"former", name
        write(path)
        assert path.stat().st_size > 300, name
        assert [left.name for left in tmp_path.iterdir()] == [name], "nothing else is left"
        path.unlink()


def test_another_size_or_other_channels_are_not_the_picture(addon, writers, tmp_path):
    writers["map.exr"](path := tmp_path / "map.exr")
    assert addon.written.check_picture(path, (64, 64), alpha=False) == (64, 64)
    for size, alpha in (((64, 63), False), ((64, 64), True)):
        with pytest.raises(OSError, match="only a part"):
            addon.written.check_picture(path, size, alpha=alpha)


def test_a_saved_file_keeps_the_former_version(addon, scene, tmp_path):
    path = tmp_path / "a.blend"
    path.write_bytes(b"former")
    addon.shared_options.save(path)
    assert (tmp_path / "a.blend1").read_bytes() == b"former" and path.stat().st_size > 1000
