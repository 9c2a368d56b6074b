# SPDX-License-Identifier: GPL-3.0-or-later
"""A run of this program that works for another program, such as the bake that a button of Blender starts.

The other program names the job by a private folder, in which it holds a lock as long as it lives. It may be killed: its
run notices this and ends too.
"""

import os
import shutil
from pathlib import Path

from .locks import try_lock

# The environment variable that holds the path of the job's folder.
JOB_VARIABLE = "NATURAL_GRATINGS_JOB"
# The file in the job's folder that who started the job has locked.
LOCK = "lock"


def job_name() -> str:
    """The name of the job that this process works for; empty if it works for none."""
    return Path(os.environ.get(JOB_VARIABLE, "")).name


def is_forsaken() -> bool:
    """Whether this process works for a job whose starter has ended."""
    folder = os.environ.get(JOB_VARIABLE)
    if not folder:
        return False
    try:
        lock = try_lock(Path(folder) / LOCK)
    except FileNotFoundError:
        return True
    except OSError:  # a folder that cannot be looked into says nothing
        return False
    if lock is not None:
        lock.close()
    return lock is not None


def remove_if_forsaken() -> None:
    """Remove the job's folder if nobody else will."""
    if is_forsaken():
        shutil.rmtree(os.environ[JOB_VARIABLE], ignore_errors=True)
