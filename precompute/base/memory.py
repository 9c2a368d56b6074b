# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory that is free, and the refusal of work that would take too much of it."""

import os
from collections.abc import Iterator
from pathlib import Path

from .failure import GratingError, Words

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]  # a module has no type that includes None

# Work may take this share of what is free. Estimates are rough, and Blender and its scene want memory too.
_SHARE = 0.5
# Accounts of a group of processes, in either version of the kernel's: their folder below /sys/fs/cgroup, and the names
# of the limit, of the use, and of the cached files among what is used.
_CGROUP_2 = ("", "memory.max", "memory.current", "inactive_file")
_CGROUP_1 = ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")


def refuse_beyond_memory(needed_bytes: float, what: str, remedy: Words, *, source: str | Path = "") -> None:
    """Raise GratingError "SOURCE: WHAT would take ...; REMEDY" if `needed_bytes` are more than half of the memory that
    is free.

    Where the system does not tell how much is free, nothing is refused."""
    free = free_bytes()
    if free is not None and needed_bytes > _SHARE * free:
        raise GratingError(
            source,
            f"{what} would take {in_words(needed_bytes)} of memory, more than half of the {in_words(free)} that are "
            "free",
            remedy,
        )


def in_words(count: float) -> str:
    """Bytes as text: "3.1 GiB"."""
    return f"{count / 2**30:.3g} GiB" if count >= 2**30 else f"{count / 2**20:.0f} MiB"


def free_bytes(root: Path = Path("/")) -> int | None:
    """The bytes that this process may still take: what the machine has free, what its groups of processes (containers)
    and its own address space may still grow by, whichever is least.

    On macOS, which gives no such figure without a foreign function, it is all of the machine's memory; on Windows None.
    `root` is where /proc and /sys are found."""
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
    """What each group that this process is in may still take, from its own group outwards. Cached files do not count as
    taken, since the system gives them up."""
    for line in _lines(root / "proc" / "self" / "cgroup"):
        number, controllers, name = line.split(":", 2)
        if number != "0" and "memory" not in controllers.split(","):
            continue
        below, limit, used, cached = _CGROUP_2 if number == "0" else _CGROUP_1
        top = root / "sys" / "fs" / "cgroup" / below
        own = top / name.strip("/")
        # Inside a container the name is often that outside, and only the top is there.
        for folder in (each for each in (own, *own.parents) if each.is_relative_to(top)):
            limit_text, used_text = (_lines(folder / file) for file in (limit, used))
            if limit_text and used_text and limit_text[0] != "max":
                counts = dict(line.split() for line in _lines(folder / "memory.stat"))
                yield int(limit_text[0]) - int(used_text[0]) + int(counts.get(cached, 0))


def _address_space(root: Path) -> Iterator[int]:
    """What the limit of `ulimit -v` leaves."""
    taken = _lines(root / "proc" / "self" / "statm")
    if resource is None or not taken:
        return
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        yield limit - int(taken[0].split()[0]) * resource.getpagesize()


def _lines(path: Path) -> list[str]:
    """The lines of a file of the system; none where it is not there or tells nothing."""
    try:
        return path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return []
