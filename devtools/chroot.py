# SPDX-License-Identifier: GPL-3.0-or-later
"""A real Blender on Debian: debootstrap installs Debian sid with its Blender into a folder, and a wrapper runs it."""

import os
import shutil
import sys
from pathlib import Path

from . import ENVIRONMENTS, DevError
from .blender import CHROOT_BLENDER, binary_version
from .machine import install_debian_packages, is_debian
from .steps import run_step, say

SID = ENVIRONMENTS / "sid"
PACKAGES = "blender python3-numpy python3-cattr python3-requests libgl1 libopengl0 libegl1 libgl1-mesa-dri"

# The mounts are in the process's own mount namespace and end with it. The machine's folders, except system folders,
# have the same paths inside, so paths on a command line keep their meaning.
WRAPPER = """\
#!/bin/sh
# Runs Blender, or what CHROOT_RUN names, in the Debian sid beside this script.
root=$(dirname "$(readlink -f "$0")")/{folder}
export CHROOT_ROOT="$root" CHROOT_CWD="$PWD"
exec unshare --mount --propagation private sh -c '
    show() {{ mkdir -p "$CHROOT_ROOT$1" && mount --rbind "$1" "$CHROOT_ROOT$1" || exit 1; }}
    for path in /*; do
        case $path in
            /bin|/boot|/etc|/lib*|/lost+found|/opt|/run|/sbin|/usr|/var) continue ;;
        esac
        [ ! -d "$path" ] || [ -L "$path" ] || show "$path"
    done
    [ -d "$CHROOT_ROOT$CHROOT_CWD" ] || show "$CHROOT_CWD"
    exec chroot "$CHROOT_ROOT" /usr/bin/env --chdir="$CHROOT_CWD" "${{CHROOT_RUN:-blender}}" "$@"
' sh "$@"
"""


def write_wrapper(path: Path, root: Path) -> None:
    """Write the script that runs Blender in the Debian at `root`."""
    path.write_text(WRAPPER.format(folder=root.name))
    path.chmod(0o755)


def set_up() -> Path:
    """Make .env/sid and the wrapper .env/sid-blender, in about a minute. Returns the wrapper's path. After an
    interruption it starts from nothing. Raises DevError if the machine is not Debian or the user is not root."""
    if CHROOT_BLENDER.exists():
        say(f"Blender {'.'.join(map(str, binary_version(CHROOT_BLENDER)))} is there: {CHROOT_BLENDER}")
        return CHROOT_BLENDER
    if sys.platform != "linux" or not is_debian():
        raise DevError("blender-setup is for Debian; remedy: install Blender and name it with --blender PATH")
    if os.geteuid() != 0:
        raise DevError("debootstrap and chroot want root; remedy: sudo ./dev blender-setup, or use --blender")
    if shutil.which("debootstrap") is None:
        install_debian_packages(["debootstrap"], "debootstrap is missing")
    partial = SID.with_name("sid.partial")
    shutil.rmtree(partial, ignore_errors=True)
    shutil.rmtree(SID, ignore_errors=True)
    logs = ENVIRONMENTS / "logs"
    # debootstrap mounts /proc in the folder. In its own mount namespace, that mount ends with it.
    private = ["unshare", "--mount", "--propagation", "private"]
    debootstrap = [*private, "debootstrap", "--variant=minbase", "sid", partial]
    run_step("Debian sid in a folder", debootstrap, logs / "debootstrap.log")
    shutil.copy("/etc/resolv.conf", partial / "etc" / "resolv.conf")
    wrapper = ENVIRONMENTS / "sid-partial-run"
    write_wrapper(wrapper, partial)
    quiet = {"DEBIAN_FRONTEND": "noninteractive", "CHROOT_RUN": "apt-get"}
    install = [wrapper, "install", "-y", "--no-install-recommends", *PACKAGES.split()]
    run_step("Blender from Debian sid", install, logs / "sid-blender.log", **quiet)
    wrapper.unlink()
    partial.rename(SID)
    write_wrapper(CHROOT_BLENDER, SID)
    return CHROOT_BLENDER
