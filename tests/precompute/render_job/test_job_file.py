# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs in TOML: what they declare, and the one line that each fault gets."""

import re
from pathlib import Path

import pytest

from precompute.base.failure import GratingError
from precompute.presets.presets import FOLDER as PRESETS
from precompute.render_job.job_file import EXAMPLE, read_job
from precompute.render_job.pictures import pictures_of, scene_names
from precompute.render_job.plan import (
    PLAN_FORMAT,
    parse_frames,
    plain_name,
    plan_of,
    read_plan,
    recipe_of_plan,
    write_record,
)

THUMBNAILS = """
output = "thumbnails"
[pictures]
zooms = [1, 1.6, 2.5]
engines = ["cycles", "eevee"]
samples = 8
[[grating]]
preset = "sunbeam_snake"
[[grating]]
preset = "corn_snake"
[[light]]
lamp = "Sun 1"
azimuth_deg = [0, 90, 180, 270]
elevation_deg = [30]
"""


@pytest.fixture
def written(tmp_path):
    """A function that reads a job of this text."""

    def read(text: str, **options):
        path = tmp_path / "job.toml"
        path.write_text(text, encoding="utf-8")
        return read_job(path, **options)

    return read


def test_the_thumbnails_of_two_species(written, tmp_path):
    """Two species, three zooms, four suns and two engines are 48 pictures with names of their own."""
    job = written(THUMBNAILS)
    names = [picture.name for scene in scene_names(job) for picture in pictures_of(job, scene)]
    assert len(names) == len(set(names)) == 48
    assert names[0] == "sunbeam_snake_x1_Sun_1-a0_cycles"
    assert job.output == tmp_path / "thumbnails"
    first = pictures_of(job, "corn_snake")[0]
    assert (first.lamps[0].azimuth_deg, first.lamps[0].elevation_deg, first.samples) == (0.0, 30.0, 8)


def test_the_example_of_the_help_is_a_job_with_every_key(written):
    """Three surfaces, two lamp angles each way, two strengths: the example's pictures are counted by hand."""
    job = written(EXAMPLE)
    assert [surface.name for surface in job.surfaces] == ["cd_gold", "cd_silver", "skin"]
    # 13 frames, 2 zooms, 2 x 2 x 2 states of the lamp, 2 seeds in Cycles and 1 in EEVEE.
    assert len(pictures_of(job, "skin")) == 13 * 2 * 8 * 3
    assert None not in (job.scene, *job.views.quality.values())


def test_what_is_left_out_is_the_scene_s_own(written, tmp_path):
    """A job of a scene alone is one picture, and nothing in it is set."""
    job = written('scene = "snake.blend"')
    (picture,) = pictures_of(job, *scene_names(job))
    assert picture.name == "scene"
    values = (picture.camera, picture.zoom, picture.lamps, picture.engine, picture.seed, picture.frame)
    assert values == (None, None, (), None, None, None)
    assert (job.scene, job.output, job.surfaces) == (tmp_path / "snake.blend", tmp_path / "job", ())


def test_the_open_file_is_the_scene_of_a_job_that_names_none(written):
    assert written("needs = false", opened=Path("/open.blend")).scene == Path("/open.blend")
    assert written('scene = "/own.blend"', opened=Path("/open.blend")).scene == Path("/own.blend")


def test_a_grating_of_several_matters_is_several_surfaces(written):
    text = '[[grating]]\npreset = "cd"\nmatters = ["gold", "6x(1.68/80nm, 1.56/90nm), 1.56"]'
    first, second = written(text).surfaces
    assert (first.name, str(first.request.matter)) == ("cd_gold", "gold")
    assert second.name == "cd_6x_1.68_80nm_1.56_90nm_1.56"
    assert first.request.scans == second.request.scans


def test_a_long_plan_keeps_its_recipe(written, tmp_path):
    """4,000 pictures take more than 1 MiB; a scene is not made again for that."""
    pictures = pictures_of(written('scene = "a.blend"\n[pictures]\nframes = "1-4000"'), "scene")
    plan = tmp_path / "scene.json"
    write_record(plan, plan_of("scene.blend", "recipe", pictures, made_by={}))
    assert plan.stat().st_size > 1 << 20 and recipe_of_plan(plan) is None
    (tmp_path / "scene.blend").touch()
    assert recipe_of_plan(plan) == "recipe"


def test_eevee_has_one_seed(written):
    job = written('scene = "a.blend"\n[pictures]\nengines = ["cycles", "eevee"]\nseeds = [3, 4]')
    found = [(one.engine, one.seed) for one in pictures_of(job, "scene")]
    assert found == [("cycles", 3), ("cycles", 4), ("eevee", 3)]


def test_a_picture_s_id_follows_all_that_it_depends_on(written):
    """The same job gives the same ids; another scene, sample count or direction gives others."""
    job = written(THUMBNAILS)
    pictures = pictures_of(job, "corn_snake")

    def ids(recipe, pictures):
        plan = plan_of("corn_snake.blend", recipe, pictures, made_by={})
        assert plan["format"] == PLAN_FORMAT
        return [one["id"] for one in plan["pictures"]]

    assert ids("recipe", pictures) == ids("recipe", pictures)
    assert len(set(ids("recipe", pictures))) == len(pictures)
    assert not set(ids("recipe", pictures)) & set(ids("other", pictures))
    others = pictures_of(written(THUMBNAILS.replace("samples = 8", "samples = 9")), "corn_snake")
    assert not set(ids("recipe", pictures)) & set(ids("recipe", others))


@pytest.mark.parametrize(("text", "frames"), [
    ("7", (7,)), ("1-4", (1, 2, 3, 4)), ("1-7:3, 30", (1, 4, 7, 30)), ("-2-1", (-2, -1, 0, 1)), ("3,1-3", (3, 1, 2)),
])  # fmt: skip
def test_frames(text, frames):
    assert parse_frames(text) == frames


@pytest.mark.parametrize(
    "text",
    ["", "a", "1-", "4-1", "1-4:0", "1..4", "1,,2", "99999999", "2-1048575", "1-100001", "1-60000,1-60000", "１"],
)
def test_what_is_no_range_of_frames(text):
    with pytest.raises(ValueError):
        parse_frames(text)


@pytest.mark.parametrize(("text", "told"), [
    ("scene = ", "not TOML"),
    ("scene = 3", "scene: cannot be 3; give a text"),
    ("skene = 'a'", "skene: no such key; there are scene, output, needs, pictures, grating, light"),
    ('scene = "a"\n[pictures]\nframes = "4-1"', "pictures.frames: cannot be '4-1'; give ranges such as"),
    ('scene = "a"\n[pictures]\nframes = [1.5]', "pictures.frames: cannot be 1.5"),
    ('scene = "a"\n[pictures]\nzooms = [0]', "pictures.zooms: cannot be 0; give a number from 0.001 to 1000"),
    ('scene = "a"\n[pictures]\nzooms = [nan]', "pictures.zooms: cannot be nan"),
    (f'scene = "a"\n[pictures]\nzooms = [{"9" * 400}]', "pictures.zooms: cannot be 999"),
    ('scene = "a"\n[pictures]\nzooms = [1, 1.0]', "pictures.zooms: a value appears twice"),
    ('scene = "a"\n[pictures]\nzooms = []', "pictures.zooms: cannot be []"),
    ('scene = "a"\n[pictures]\nengines = ["workbench"]', "pictures.engines: cannot be 'workbench'; give one of cycles"),
    ('scene = "a"\n[pictures]\nsamples = true', "pictures.samples: cannot be True"),
    ('scene = "a"\n[pictures]\ndenoise = 1', "pictures.denoise: cannot be 1; give true or false"),
    ('scene = "a"\npictures = 3', "pictures: is not a table"),
    ('scene = "a"\n[grating]\npreset = "cd"', "grating: is not a list of tables; write each as [[grating]]"),
    ("[[grating]]\nname = 'a'", "grating 1.preset: give either `preset` or `scans`"),
    ('[[grating]]\npreset = "ce"', "grating 1: preset ce: there is no such preset"),
    ('[[grating]]\npreset = "cd"\nmatters = ["mud"]', "grating 1: "),
    ('[[grating]]\npreset = "cd"\ndelta_e = -1', "grating 1: its bake: delta_e: cannot be -1"),
    ('[[grating]]\npreset = "cd"\nsize_um = 3', "grating 1.size_um: no such key"),
    ('[[grating]]\nscans = ["a.png"]', "grating: scans need a scene"),
    ('[[grating]]\npreset = "cd"\n[[grating]]\npreset = "cd"', "grating: cd appears twice"),
    ('[[grating]]\npreset = "cd"\ninputs = {Roughness = "a"}', "grating 1.inputs.Roughness: cannot be 'a'"),
    ('scene = "a"\nneeds = true', "needs: there is no grating to bake"),
    ('scene = "a"\n[[light]]\nstrength = [1]', "light 1.lamp: is missing"),
    ('scene = "a"\n[[light]]\nlamp = "S"\nazimuth_deg = [1]', "azimuth_deg: one angle alone gives no direction"),
    ('scene = "a\\u0000"', "scene: not a file name"),
])  # fmt: skip
def test_each_fault_is_a_line_with_its_key(written, tmp_path, text, told):
    with pytest.raises(GratingError) as caught:
        written(text)
    line = str(caught.value)
    assert line.startswith(f"{tmp_path / 'job.toml'}: ") and "\n" not in line
    assert told in line


def test_a_job_of_too_many_pictures_is_refused(written):
    text = 'scene = "a"\n[pictures]\nframes = "1-1000"\nseeds = [' + ",".join(map(str, range(101))) + "]"
    with pytest.raises(GratingError, match="101000 pictures; split the job"):
        pictures_of(written(text), "scene")


def test_a_job_of_very_many_pictures_is_refused_before_they_are_made(written):
    """Three lists of ten thousand would be 10^12 directions of one lamp."""
    many = ",".join(f"{number / 100}" for number in range(9000))
    lists = f"azimuth_deg = [{many}]\nelevation_deg = [{many}]".replace("89.99", "0.001")
    job = written(f'scene = "a"\n[[light]]\nlamp = "S"\n{lists}\nstrength = [{many}]')
    with pytest.raises(GratingError, match="729000000000 pictures; split the job"):
        pictures_of(job, "scene")


def test_pictures_of_one_name_are_refused(written):
    """Names of cameras that differ in characters that file names cannot have, or in case, which Windows ignores."""
    text = 'scene = "a"\n[pictures]\ncameras = ["A?", "a/"]'
    with pytest.raises(GratingError, match="two pictures would be scene_a"):
        pictures_of(written(text), "scene")


@pytest.mark.parametrize(("text", "name"), [
    ("a/b", "a_b"), ("../..", "_"), ("Käfer", "Käfer"), ("Ka\u0308fer", "Käfer"), ("cd 2", "cd_2"), ("-x", "x"),
    ("Камера", "Камера"), ("蛇", "蛇"), ("कि", "कि"), ("{{b}}", "b"),
])  # fmt: skip
def test_names_are_plain(text, name):
    assert plain_name(text) == plain_name(name) == name


def test_a_long_name_is_shortened_before_it_is_baked(written):
    """File systems allow 255 bytes, and a scene that is not whole yet has 24 more than its name."""
    job = written(f'scene = "a"\n[pictures]\nframes = [1, 2]\n[[grating]]\npreset = "cd"\nname = "{"ж" * 245}"')
    names = [*scene_names(job), *(picture.name for picture in pictures_of(job, *scene_names(job)))]
    assert len(set(names)) == 3 and max(len(name.encode()) for name in names) <= 200
    assert list(map(plain_name, names)) == names


def test_an_output_that_holds_an_input_is_refused(written, tmp_path):
    """The job's file, its scene, a scan, a preset's file; also through a link in place of a folder of the output."""
    (tmp_path / "mine.json").write_text((PRESETS / "cd.json").read_text())
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "scenes").symlink_to(tmp_path / "art", target_is_directory=True)
    for text, held in (
        ('output = "."\nscene = "scenes/g.blend"', "job.toml"), ('output = "out"\nscene = "out/g.blend"', "g.blend"),
        ('output = "linked"\nscene = "art/g.blend"', "g.blend"),
        ('output = "out"\nscene = "a"\n[[grating]]\nscans = ["out/a.nid"]', "a.nid"),
        (f'output = "{tmp_path.as_posix()}"\n[[grating]]\npreset = "mine.json"', "job.toml"),
    ):  # fmt: skip
        with pytest.raises(GratingError, match=f"output: .* holds .*{held}, which the job reads; give a folder of its"):
            written(text)
    assert written('[[grating]]\npreset = "mine.json"').inputs == [tmp_path / "job.toml", tmp_path / "mine.json"]


def test_a_plan_that_was_changed_is_refused(written, tmp_path):
    """Names that leave the output, values that no picture has, and keys that are missing."""
    pictures = pictures_of(written(THUMBNAILS), "corn_snake")
    plan, path = plan_of("corn_snake.blend", "recipe", pictures, made_by={}), tmp_path / "plan.json"
    write_record(path, plan)
    assert read_plan(path) == plan
    for key, value, told in (
        ("name", "../../escaped", "pictures 1.name: cannot be '../../escaped'"),
        ("name", "/a", "pictures 1.name: "), ("name", "a\\b", "pictures 1.name: "), ("name", None, "pictures 1.name: "),
        ("zoom", "wide", "pictures 1.zoom: cannot be 'wide'"), ("zoom", float("nan"), "pictures 1.zoom: "),
        ("samples", 10**30, "pictures 1.samples: "),
        ("lamps", [{"lamp": "Sun 1", "azimuth_deg": 1}], "lamps 1.azimuth_deg: "),
        ("samples", 9, "it was changed"), ("id", "0" * 64, "it was changed"), ("extra", 1, "pictures 1.extra: no such"),
    ):  # fmt: skip
        first, *others = plan["pictures"]
        write_record(path, plan | {"pictures": [first | {key: value}, *others]})
        with pytest.raises(GratingError, match=rf"plan.json: not a usable plan \({re.escape(told)}.*; run the"):
            read_plan(path)
    for changed in ({"scene": "../a.blend"}, {"scene": "a"}, {"pictures": {}}, {"format": 0}, {"made_by": 1}, {"x": 1}):
        write_record(path, plan | changed)
        with pytest.raises(GratingError, match="not a usable plan"):
            read_plan(path)
