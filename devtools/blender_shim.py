# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in for the `blender` binary that uses a bpy wheel: the same arguments in order, the same exit statuses.

It does only what needs no window, and fails as Blender 5.2 does. After a script raises, the next argument is processed
unless --python-exit-code was given. After a file that cannot be read, only a --command still runs; without one the
status is 1. A --command that raises gives status 1."""

import contextlib
import os
import runpy
import sys
import traceback
from collections.abc import Callable, Iterator
from functools import partial
from itertools import dropwhile
from pathlib import Path

import bpy

EXTENSION = "bl_ext.user_default.natural_gratings"
COMMAND = ("-c", "--command")
USAGE = """\
Blender {version} from the bpy wheel, without a window. Arguments, carried out in their order:
  FILE                           open a .blend file
  -b, --background               required, unless there is a --command
  -P, --python FILE              run a script (after `--` come its own arguments)
  --python-expr CODE             run a line of Python
  --python-exit-code N           exit with N where a later script raises
  -c, --command NAME ARGS...     run an add-on's command (grating, extension); takes all that follows
  --addons A,B                   enable add-ons
  -E, --engine ENGINE            -S, --scene NAME            -t, --threads N
  -o, --render-output PATH       -F, --render-format FORMAT  -f, --render-frame FRAME[,FRAME|..]
  -s, --frame-start N            -e, --frame-end N           -a, --render-anim
  -y, -Y                         let scripts in files run, or not
  --factory-startup              leave Natural Gratings off
  --offline-mode, --online-mode, -noaudio, --quiet   nothing, here
"""

commands: dict[str, Callable[[list[str]], int]] = {}


def fail(text: str) -> None:
    """Exit with an error."""
    print(f"Error: {text}", file=sys.stderr)
    sys.exit(1)


def show_hidden_packages() -> None:
    """Add the folder of oslquery and OpenImageIO to the path: Script nodes need them, and the wheel hides them."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    blender = Path(bpy.utils.resource_path("LOCAL"))
    sys.path.append(str(blender / "python" / "lib" / version / "site-packages"))


def record_commands() -> None:
    """Record the commands that add-ons register. Otherwise only the binary could reach them."""
    register = bpy.utils.register_cli_command

    def register_and_record(name: str, execute: Callable[[list[str]], int]) -> object:
        commands[name] = execute
        return register(name, execute)

    bpy.utils.register_cli_command = register_and_record
    import bl_pkg

    commands["extension"] = bl_pkg.cli_extension


def extension_is_installed() -> bool:
    return Path(bpy.utils.user_resource("EXTENSIONS"), "user_default", "natural_gratings").exists()


def enable(module: str, *, is_preferred: bool = False) -> None:
    """Enable an add-on, or print that it cannot be enabled. `is_preferred`: as one that the preferences name, among
    which exporters look for hooks."""
    import addon_utils  # importable only after bpy

    if addon_utils.enable(module, default_set=is_preferred) is None:
        print(f"Error: add-on {module} cannot be enabled", file=sys.stderr)


def context_of_commands() -> contextlib.AbstractContextManager:
    """The context in which the binary runs a --command: once a file is open, it has no window."""
    return bpy.context.temp_override(window=None) if bpy.data.filepath else contextlib.nullcontext()


def run_command(name: str, arguments: list[str]) -> None:
    """Run an add-on's command and exit with its status."""
    if name == "grating" and name not in commands:
        if not extension_is_installed():
            os.environ["BLENDER_USER_EXTENSIONS"] = os.environ["NATURAL_GRATINGS_LINKED_EXTENSIONS"]
        enable(EXTENSION)
    if name == "help":
        print("\n\t".join(["Blender Command Listing:", *sorted(commands)]))
        sys.exit(0)
    if name not in commands:
        fail(f'Unrecognized command: "{name}"')
    try:
        with context_of_commands():
            status = commands[name](arguments)
    except Exception:
        traceback.print_exc()
        sys.exit(1)
    if not isinstance(status, int):
        fail(f"Expected an int return value, not a {type(status).__name__}")
    sys.exit(status)


def run_script(run: Callable[[], object], name: str, exit_code: int) -> None:
    """Run a script. If it raises, exit with exit_code unless that is 0."""
    try:
        run()
    except Exception:
        traceback.print_exc()
        if exit_code:
            print(f"Error: script failed, {name}, exiting.", file=sys.stderr)
            sys.exit(exit_code)


def open_file(path: str, following: Iterator[str]) -> None:
    """Open a file. If it cannot be read, exit, after the command if one is among the arguments that follow."""
    try:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(path))
    except RuntimeError:
        print(f'Error: Cannot read file "{path}"', file=sys.stderr)
        command = list(dropwhile(lambda argument: argument not in COMMAND, following))
        if command[1:]:
            run_command(command[1], command[2:])
        sys.exit(1)


def frames(text: str) -> Iterator[int]:
    """The frames that -f names, such as 1,3 and 5..8. +N counts from the scene's first frame, -N from its last."""
    scene = bpy.context.scene
    for part in text.split(","):
        first, _, last = part.partition("..")
        if part.startswith("+"):
            yield scene.frame_start + int(part[1:])
        elif part.startswith("-"):
            yield scene.frame_end - int(part[1:]) + 1
        else:
            yield from range(int(first), int(last or first) + 1)


def render_frames(text: str) -> None:
    scene = bpy.context.scene
    output = scene.render.filepath
    for frame in frames(text):
        scene.frame_set(frame)
        scene.render.filepath = bpy.path.abspath(scene.render.frame_path(frame=frame))
        bpy.ops.render.render(write_still=True, scene=scene.name)
        scene.render.filepath = output


def render_animation(_: object = None) -> None:
    bpy.ops.render.render(animation=True, scene=bpy.context.scene.name)


def set_render(name: str) -> Callable[[str], None]:
    return lambda value: setattr(bpy.context.scene.render, name, value)


def set_frame(name: str) -> Callable[[str], None]:
    return lambda value: setattr(bpy.context.scene, name, int(value))


def set_scene(name: str) -> None:
    bpy.context.window.scene = bpy.data.scenes[name]


def set_format(name: str) -> None:
    bpy.context.scene.render.image_settings.file_format = {"EXR": "OPEN_EXR"}.get(name, name)


def set_threads(count: str) -> None:
    render = bpy.context.scene.render
    render.threads_mode = "FIXED" if int(count) else "AUTO"
    render.threads = int(count) or render.threads


def set_output(path: str) -> None:
    bpy.context.scene.render.filepath = path if path.startswith("//") else os.path.abspath(path)


def set_auto_run(allowed: bool) -> Callable[[], None]:
    return lambda: setattr(bpy.context.preferences.filepaths, "use_scripts_auto_execute", allowed)


def nothing() -> None:
    pass


FLAGS = {
    "-y": set_auto_run(True),
    "--enable-autoexec": set_auto_run(True),
    "-Y": set_auto_run(False),
    "--disable-autoexec": set_auto_run(False),
    "-a": render_animation,
    "--render-anim": render_animation,
}
for flag in (
    "-b",
    "--background",
    "--factory-startup",
    "--offline-mode",
    "--online-mode",
    "-noaudio",
    "--quiet",
):
    FLAGS[flag] = nothing

OPTIONS = {
    "--addons": lambda names: [enable(name) for name in names.split(",")],
    "-E": set_render("engine"),
    "--engine": set_render("engine"),
    "-S": set_scene,
    "--scene": set_scene,
    "-t": set_threads,
    "--threads": set_threads,
    "-o": set_output,
    "--render-output": set_output,
    "-F": set_format,
    "--render-format": set_format,
    "-f": render_frames,
    "--render-frame": render_frames,
    "-s": set_frame("frame_start"),
    "--frame-start": set_frame("frame_start"),
    "-e": set_frame("frame_end"),
    "--frame-end": set_frame("frame_end"),
}


def own_arguments(arguments: list[str]) -> list[str]:
    """The arguments for Blender itself: all before `--`, or up to and including a command's flag."""
    ends = [index for index, argument in enumerate(arguments) if argument in ("--", *COMMAND)]
    return arguments[: ends[0] + 1] if ends else arguments


def carry_out(arguments: list[str]) -> None:
    """Process the arguments in order."""
    exit_code = 0
    queue = iter(arguments)
    for argument in queue:
        if argument == "--":
            return
        if argument in FLAGS:
            FLAGS[argument]()
            continue
        if not argument.startswith("-"):
            open_file(argument, queue)
            continue
        value = next(queue, None)
        if value is None:
            fail(f"{argument} needs a value")
        if argument in COMMAND:
            run_command(value, list(queue))
        elif argument in ("-P", "--python"):
            run_script(
                partial(runpy.run_path, os.path.abspath(value), run_name="__main__"), f"file: '{value}'", exit_code
            )
        elif argument == "--python-expr":
            run_script(partial(exec, value, {"__name__": "__main__"}), f"expr: '{value}'", exit_code)
        elif argument == "--python-exit-code":
            exit_code = int(value)
        elif argument in OPTIONS:
            OPTIONS[argument](value)
        else:
            fail(f"{argument}: unknown to the shim over the bpy wheel; remedy: --help, or --blender PATH")


def main(arguments: list[str]) -> None:
    """Do what `blender` does with these arguments."""
    own = own_arguments(arguments)
    if "-v" in own or "--version" in own:
        print(f"Blender {bpy.app.version_string} (bpy wheel)")
        return
    if "-h" in own or "--help" in own:
        print(USAGE.format(version=bpy.app.version_string))
        return
    if not {"-b", "--background", *COMMAND} & set(own):
        fail("the bpy wheel has no window; remedy: add --background")
    sys.argv = ["blender", *arguments]
    show_hidden_packages()
    record_commands()
    if "--factory-startup" not in own and extension_is_installed():
        enable(EXTENSION, is_preferred=True)
    carry_out(arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
