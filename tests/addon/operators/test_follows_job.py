# SPDX-License-Identifier: GPL-3.0-or-later
"""Following a job: the status bar, the job's end, and Esc."""

import importlib
from types import SimpleNamespace

import pytest

from devtools import EXTENSION


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
    base = importlib.import_module(f"{EXTENSION}.addon.operators.follows_job").FollowsJob
    told, bar, timers = [], [], []

    class Follower(base):
        def report(self, kind, line):
            told.append(line)

        def finish(self, job):
            told.append("finished")
            return {"FINISHED"}

    manager = SimpleNamespace(
        windows=[],
        event_timer_add=lambda seconds, window: timers.append(seconds) or seconds,
        event_timer_remove=timers.remove,
        modal_handler_add=lambda operator: None,
    )
    context = SimpleNamespace(
        window_manager=manager, window=None, workspace=SimpleNamespace(status_text_set=bar.append)
    )
    follower, job = Follower(), Job()
    assert follower.follow(context, job, "Combing Snake") == {"RUNNING_MODAL"}
    assert Follower.job is job and base.job is None and timers
    return SimpleNamespace(follower=follower, job=job, context=context, told=told, bar=bar, timers=timers)


def event(kind):
    return SimpleNamespace(type=kind)


def test_the_status_bar_shows_how_far_it_is(following):
    assert following.follower.modal(following.context, event("MOUSEMOVE")) == {"PASS_THROUGH"}
    assert not following.bar
    assert following.follower.modal(following.context, event("TIMER")) == {"PASS_THROUGH"}
    assert following.bar == ["Combing Snake: combing 50%   [Esc] cancels"]


def test_at_the_end_it_finishes(following):
    following.job.running = False
    assert following.follower.modal(following.context, event("TIMER")) == {"FINISHED"}
    assert following.told == ["finished"] and following.bar == [None] and not following.timers
    assert following.follower.job is None and not following.job.cancelled


def test_esc_cancels_it(following):
    assert following.follower.modal(following.context, event("ESC")) == {"CANCELLED"}
    assert following.told == ["Combing Snake: cancelled; nothing was changed"]
    assert following.job.cancelled and following.follower.job is None and not following.timers


def test_what_others_stopped_is_cancelled(following):
    """As by disabling the extension."""
    type(following.follower).stop()
    assert following.job.cancelled
    assert following.follower.modal(following.context, event("TIMER")) == {"CANCELLED"}
    type(following.follower).stop()
