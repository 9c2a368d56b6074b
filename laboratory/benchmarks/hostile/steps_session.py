# SPDX-License-Identifier: GPL-3.0-or-later
"""A random session in Blender: the extension's buttons, an artist's acts, undo and redo, each judged.

`./dev bench random_steps` runs sessions in child processes (random_steps.py). The program writes a line of JSON before
and after each step, so that the last steps are known if Blender crashes."""

import json
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random
from types import SimpleNamespace

from .blends import _FAULTS, _last_line, _redirected
from .steps_acts import ACTS
from .steps_buttons import BUTTONS, Hand, press
from .steps_checks import Contents, contents, differences, draw_panels, faults, leftovers

# Most processor seconds of a step, with the processes that it starts.
SECONDS_MAX = 20.0
# Shares of the steps. The rest are an artist's acts.
_BUTTON, _UNDO, _REDO = 0.5, 0.14, 0.1
# Undo steps that Blender keeps, and that the session goes back to. A step may make more than one.
_KEPT, _REMEMBERED = 256, 120


class Session:
    """A session with its random numbers, and the contents of the file at each undo step."""

    def __init__(self, addon: SimpleNamespace, scan: Path, seed: int) -> None:
        import bpy

        self._addon = addon
        self._hand = Hand(Random(seed), scan)
        bpy.context.preferences.edit.undo_steps = _KEPT
        self._push()
        self._states, self._at = [_state()], 0

    def step(self) -> tuple[str, Callable[[], str]]:
        """A random step: its text, and a function that takes it and returns a refusal, or an empty text."""
        kind = self._hand.random.random()
        if kind < _UNDO and self._at > 0:
            return self._moved(-self._hand.random.randint(1, min(4, self._at)))
        if kind < _UNDO + _REDO and self._at < len(self._states) - 1:
            return self._moved(self._hand.random.randint(1, min(4, len(self._states) - 1 - self._at)))
        if kind < _UNDO + _REDO + _BUTTON:
            text, act = press(_drawn(self._hand.random, BUTTONS), self._hand)
            return text, lambda: self._pressed(act)
        name = _drawn(self._hand.random, ACTS)
        return name, lambda: self._done(lambda: ACTS[name][1](self._hand.random))

    def undo_all(self) -> tuple[str, Callable[[], str]]:
        """Undo all remembered steps."""
        return self._moved(-self._at)

    def redo_all(self) -> tuple[str, Callable[[], str]]:
        """Redo all undone steps."""
        return self._moved(len(self._states) - 1 - self._at)

    def _moved(self, by: int) -> tuple[str, Callable[[], str]]:
        """Undo or redo as many steps, and compare the file with what it was."""

        def move() -> str:
            import bpy

            for _ in range(abs(by)):
                (bpy.ops.ed.undo if by < 0 else bpy.ops.ed.redo)()
            self._at += by
            _update()
            mode, former = self._states[self._at]
            # In other modes Blender's undo steps hold only what the mode edits.
            different = differences(former, contents()) if mode == "OBJECT" else ""
            assert not different, f"the file differs from its former state: {different}"
            return ""

        return f"{'undo' if by < 0 else 'redo'} {abs(by)}", move

    def _pressed(self, act: Callable[[], object]) -> str:
        """Press a button. Returns the line of a refusal, which must change nothing."""
        before, refusal = contents(), ""
        try:
            act()
        except RuntimeError as error:
            refusal = str(error).strip()
            assert "\n" not in refusal, f"a refusal of several lines: {refusal}"
            assert "context is incorrect" not in refusal, "a button is grey without a reason"
            different = differences(before, contents())
            assert not different, f"{refusal}, and something changed: {different}"
        return self._done(lambda: None) or refusal

    def _done(self, act: Callable[[], None]) -> str:
        """Do something and make it an undo step."""
        act()
        _update()
        del self._states[self._at + 1 :]
        self._states.append(_state())
        del self._states[:-_REMEMBERED]
        self._at = len(self._states) - 1
        self._push()
        return ""

    def _push(self) -> None:
        import bpy

        bpy.ops.ed.undo_push(message="step")


def judged(addon: SimpleNamespace, act: Callable[[], str]) -> dict[str, object]:
    """Take a step and check everything. Returns the refusal, the seconds, and the fault or an empty text."""
    addon.guard._printed.clear()
    fault = refusal = ""
    start = _seconds()
    with tempfile.TemporaryFile("w+") as printed:
        with _redirected(printed):
            try:
                refusal = act()
                seconds = _seconds() - start
                draw_panels(addon)
                fault = "; ".join(faults())
            except AssertionError as error:
                fault, seconds = str(error), _seconds() - start
            except Exception:
                fault, seconds = _last_line(traceback.format_exc()), _seconds() - start
        printed.seek(0)
        text = printed.read()
    if any(word in text for word in _FAULTS):
        fault = f"{fault}; printed: {_last_line(text)}".removeprefix("; ")
    if seconds > SECONDS_MAX:
        fault = f"{fault}; it took {seconds:.0f} s".removeprefix("; ")
    return {"refusal": refusal, "seconds": round(seconds, 2), "fault": fault}


def run(addon: SimpleNamespace, scan: Path, *, seed: int, steps: int) -> Iterator[dict[str, object]]:
    """Take random steps in a factory scene. Yields a record before and after each; the last has the fault, if any.

    At the end all is undone and redone, and then everything is deleted."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    session = Session(addon, scan, seed)
    for number in range(steps + 3):
        if number < steps:
            text, act = session.step()
        else:
            text, act = (session.undo_all, session.redo_all, _end)[number - steps]()
        yield {"step": number, "does": text}
        record = {"step": number, "does": text, **judged(addon, act)}
        yield record
        if record["fault"]:
            return


def _end() -> tuple[str, Callable[[], str]]:
    """Delete everything and purge the file."""

    def end() -> str:
        left = list(leftovers())
        assert not left, f"left after a purge: {'; '.join(left)}"
        return ""

    return "delete everything and purge", end


def _state() -> tuple[str, Contents]:
    """The mode and the contents of the file."""
    import bpy

    return bpy.context.mode, contents()


def _drawn(random: Random, weighted: dict[str, tuple]) -> str:
    """A random name, by its weight."""
    return random.choices(list(weighted), [weight for weight, *_ in weighted.values()])[0]


def _update() -> None:
    import bpy

    bpy.context.view_layer.update()


def _seconds() -> float:
    """Processor seconds of this process and of its ended children."""
    return sum(os.times()[:4])


def main(argv: Sequence[str]) -> None:
    """Run a session in this Blender process; write its records into the file `records`."""
    from ..osl import start_blender
    from .lying_scene import write_scan

    folder, given = Path(argv[0]), json.loads(argv[1])
    os.environ["NATURAL_GRATINGS_CACHE"] = given["cache"]
    addon = start_blender(folder)
    scan = write_scan(folder / "waves.png")
    with (folder / "records").open("w") as written:
        for record in run(addon, scan, seed=given["seed"], steps=given["steps"]):
            written.write(json.dumps(record | {"at": time.time()}) + "\n")
            written.flush()
    os._exit(0)  # Blender 4.5 may hang at exit


if __name__ == "__main__":
    main(sys.argv[1:])
