# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the command line as a separate program: its terminal and its signals.

The tests call parser.main instead, and Blender's command line uses parser.exit_status.
"""

import os
import signal
import sys
import warnings
from collections.abc import Mapping
from types import FrameType

from ..base.job import remove_if_forsaken
from .parser import PACKAGES, main

# The signals that ask a program to end. Windows has no SIGHUP.
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


def run(packages: Mapping[str, Mapping[str, str]] = PACKAGES) -> int:
    """Run the verb in the program's arguments. Returns the exit status."""
    warnings.simplefilter("ignore")
    keep_the_terminal_to_python()
    for name in _SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:  # nohup ignores SIGHUP
            signal.signal(number, _stop)
    status = main(packages=packages)
    remove_if_forsaken()
    return status


def _stop(number: int, _: FrameType | None) -> None:
    """End the run. The partial files are removed on the way out, which no further signal interrupts."""
    for name in _SIGNALS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    raise KeyboardInterrupt(number)


def keep_the_terminal_to_python() -> None:
    """Let only Python's own prints reach standard output and standard error.

    Lines that libtiff, OpenEXR, Blender and others write there are discarded. A character outside the terminal's
    encoding is escaped."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for number, name in ((1, "stdout"), (2, "stderr")):
        stream = getattr(sys, name)
        if stream is not None:  # None if the parent program has closed it
            ours = os.fdopen(os.dup(number), "w", encoding=stream.encoding, errors="backslashreplace", buffering=1)
            setattr(sys, name, ours)
        os.dup2(nowhere, number)
