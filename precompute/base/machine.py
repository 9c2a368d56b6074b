# SPDX-License-Identifier: GPL-3.0-or-later
"""What the machine has: free memory, and the packages bundled with the extension (OpenEXR, Pillow and xatlas).

Work that would need too much memory is refused. `bundled` imports a package only when it is needed, so the rest works
without it. A package may be missing or broken: from another platform's zip, or built for a newer system."""

import importlib
import importlib.util
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from .failure import GratingError, Words

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]  # a module has no type that includes None

# Work of fewer bytes is never refused: reading the system's files takes 4 ms, and a reference's patch less.
_SMALL = 2**20
# Work may take this share of the free memory. Estimates are rough, and Blender and its scene need memory too.
_SHARE = 0.5
# Files of Linux control groups, versions 2 and 1: folder below /sys/fs/cgroup, limit, use, and the entry of memory.stat
# that counts cached files.
_CGROUP_2 = ("", "memory.max", "memory.current", "inactive_file")
_CGROUP_1 = ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")


def refuse_beyond_memory(needed_bytes: float, what: str, remedy: Words, *, source: str | Path = "") -> None:
    """Raise GratingError "SOURCE: WHAT would take ...; REMEDY" if `needed_bytes` exceed half of the free memory.

    Does nothing for less than a MiB, and on systems that do not report free memory."""
    if needed_bytes < _SMALL:
        return
    free = free_bytes()
    if free is not None and needed_bytes > _SHARE * free:
        raise GratingError(
            source,
            f"{what} would take {in_words(needed_bytes)} of memory, more than half of the {in_words(free)} that are "
            "free",
            remedy,
        )


def in_words(count: float) -> str:
    """Format bytes: "3.1 GiB"."""
    return f"{count / 2**30:.3g} GiB" if count >= 2**30 else f"{count / 2**20:.0f} MiB"


def free_bytes(root: Path = Path("/")) -> int | None:
    """Return the bytes that this process may still allocate: the least of the machine's free memory and what the limits
    of its control groups (containers) and of its address space leave.

    On macOS, where free memory needs a foreign function call, it is all memory; on Windows None. `root` is the folder
    that holds /proc and /sys."""
    found = [*_machine(root), *_groups(root), *_address_space(root)]
    return max(0, min(found)) if found else None


def _machine(root: Path) -> Iterator[int]:
    for line in _lines(root / "proc" / "meminfo"):
        if line.startswith("MemAvailable:"):
            yield int(line.split()[1]) * 1024
            return
    if "SC_PHYS_PAGES" in getattr(os, "sysconf_names", ()):
        yield os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _groups(root: Path) -> Iterator[int]:
    """Yield the bytes left to each control group of this process, from its own group outwards.

    Cached files do not count as used, since the system drops them when it needs memory."""
    for line in _lines(root / "proc" / "self" / "cgroup"):
        number, controllers, name = line.split(":", 2)
        if number != "0" and "memory" not in controllers.split(","):
            continue
        below, limit, used, cached = _CGROUP_2 if number == "0" else _CGROUP_1
        top = root / "sys" / "fs" / "cgroup" / below
        own = top / name.strip("/")
        # In a container the name is often the outer one, of which only the top folder exists.
        for folder in (each for each in (own, *own.parents) if each.is_relative_to(top)):
            limit_text, used_text = (_lines(folder / file) for file in (limit, used))
            if limit_text and used_text and limit_text[0] != "max":
                counts = dict(line.split() for line in _lines(folder / "memory.stat"))
                yield int(limit_text[0]) - int(used_text[0]) + int(counts.get(cached, 0))


def _address_space(root: Path) -> Iterator[int]:
    """Yield the bytes left under the limit of `ulimit -v`, if there is one."""
    taken = _lines(root / "proc" / "self" / "statm")
    if resource is None or not taken:
        return
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        yield limit - int(taken[0].split()[0]) * resource.getpagesize()


def _lines(path: Path) -> list[str]:
    """Read the lines of a system file; [] if it cannot be read."""
    try:
        return path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return []


# The names under which the bundled packages are imported, and their common names.
_NAMES = {"OpenEXR": "OpenEXR", "PIL": "Pillow", "xatlas": "xatlas"}
_REMEDY = "install the extension's zip for this platform, or this package for this Python"


def missing_packages() -> list[str]:
    """The common names of the bundled packages that are missing. Loads none of them, since a panel asks at every
    redraw."""
    return [name for package, name in _NAMES.items() if importlib.util.find_spec(package) is None]


def bundled(module: str, remedy: str = _REMEDY) -> ModuleType:
    """Import a module of a bundled package.

    Raises GratingError "PACKAGE: fault; REMEDY" if the package is missing or its import raises any error."""
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except Exception as error:
        name = _NAMES.get(package, package)
        version = ".".join(map(str, sys.version_info[:2]))
        if isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] == package:
            raise GratingError(name, f"it is not installed for Python {version}", remedy) from error
        fault = f"{type(error).__name__}: {error}"
        raise GratingError(name, f"cannot be loaded ({fault:.300})", remedy) from error
