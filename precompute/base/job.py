# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs: runs of this program for another program, such as a bake that Blender started.

The other program, the starter, identifies the job by a private folder and locks a file in it for as long as it lives.
A job whose starter was killed finds the lock released, and ends too."""

import os
import shutil
from pathlib import Path

from .locks import try_lock

# Environment variable: the path of the job's folder.
JOB_VARIABLE = "NATURAL_GRATINGS_JOB"
# The file in the job's folder that the starter locks.
LOCK = "lock"


def job_name() -> str:
    """Return the name of this process's job, or "" outside a job."""
    return Path(os.environ.get(JOB_VARIABLE, "")).name


def is_forsaken() -> bool:
    """Whether this process works for a job whose starter has ended or released the lock."""
    folder = os.environ.get(JOB_VARIABLE)
    if not folder:
        return False
    try:
        lock = try_lock(Path(folder) / LOCK)
    except FileNotFoundError:
        return True
    except OSError:  # an unreadable folder proves nothing
        return False
    if lock is not None:
        lock.close()
    return lock is not None


def remove_if_forsaken() -> None:
    """Remove the folder of a forsaken job."""
    if is_forsaken():
        shutil.rmtree(os.environ[JOB_VARIABLE], ignore_errors=True)
