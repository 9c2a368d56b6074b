# SPDX-License-Identifier: GPL-3.0-or-later
"""Following a job: the status bar, the job's end, and what cancels it."""

import importlib
from types import SimpleNamespace

import bpy
import pytest

from devtools import EXTENSION
from tests.addon.layout import Layout


class Job:
    """A job that runs until it is stopped."""

    running, cancelled = True, False

    def progress(self):
        return "combing", 0.5

    def cancel(self):
        self.running, self.cancelled = False, True


@pytest.fixture
def following(extension):
    """A follower of a job, the context, and what was reported."""
    base = importlib.import_module(f"{EXTENSION}.addon.operators.shared").FollowsJob
    told, bar, timers = [], [], []

    class Follower(base):
        bl_idname = "grating.comb_in_test"

        def report(self, kind, line):
            told.append(line)

        def finish(self, job):
            return ["finished"]

    manager = SimpleNamespace(
        windows=[],
        event_timer_add=lambda seconds, window: timers.append(seconds) or seconds,
        event_timer_remove=timers.remove,
        modal_handler_add=lambda operator: None,
    )
    context = SimpleNamespace(
        window_manager=manager, window=None, workspace=SimpleNamespace(status_text_set=bar.append),
        area=SimpleNamespace(x=100, y=0, width=200, height=200), screen=SimpleNamespace(is_animation_playing=False),
    )  # fmt: skip
    follower, job = Follower(), Job()
    assert follower.follow(context, job, "Combing Snake") == {"RUNNING_MODAL"}
    assert Follower.job is job and base.job is None and timers
    return SimpleNamespace(follower=follower, job=job, context=context, told=told, bar=bar, timers=timers)


def event(kind, value="PRESS", x=150, y=50):
    return SimpleNamespace(type=kind, value=value, mouse_x=x, mouse_y=y)


def test_the_status_bar_shows_how_far_it_is(following):
    assert following.follower.modal(following.context, event("MOUSEMOVE")) == {"PASS_THROUGH"}
    assert not following.bar
    assert following.follower.modal(following.context, event("TIMER")) == {"PASS_THROUGH"}
    (draw,) = following.bar
    layout = Layout()
    draw(SimpleNamespace(layout=layout), following.context)
    assert layout.operators == ["grating.cancel"]
    following.follower.cancel(following.context)


def test_at_the_end_it_finishes(following):
    following.job.running = False
    assert following.follower.modal(following.context, event("TIMER")) == {"FINISHED"}
    assert following.told == ["finished"] and following.bar == [None] and not following.timers
    assert following.follower.job is None and not following.job.cancelled


def test_only_a_press_of_esc_over_its_own_area_cancels_it(following):
    """Blender keeps the press of Esc that ends a grab to itself, and passes its release on."""
    for other in (event("ESC", "RELEASE"), event("ESC", x=50), event("ESC", y=200), event("MOUSEMOVE")):
        assert following.follower.modal(following.context, other) == {"PASS_THROUGH"}
    following.context.screen.is_animation_playing = True
    assert following.follower.modal(following.context, event("ESC")) == {"PASS_THROUGH"}
    following.context.screen.is_animation_playing = False
    assert following.follower.job is following.job
    assert following.follower.modal(following.context, event("ESC")) == {"CANCELLED"}
    assert following.told == ["Combing Snake: cancelled; nothing was changed"]
    assert following.job.cancelled and following.follower.job is None and not following.timers


def test_its_cross_cancels_it_and_no_other(following):
    assert bpy.ops.grating.cancel(follower="grating.bake") == {"FINISHED"} and following.follower.job is following.job
    assert bpy.ops.grating.cancel(follower="grating.comb_in_test") == {"FINISHED"}
    assert following.job.cancelled
    assert following.follower.modal(following.context, event("TIMER")) == {"CANCELLED"}


def test_what_others_stopped_is_cancelled(following):
    """As by disabling the extension."""
    type(following.follower).stop()
    assert following.job.cancelled
    assert following.follower.modal(following.context, event("TIMER")) == {"CANCELLED"}
    type(following.follower).stop()
