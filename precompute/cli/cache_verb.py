# SPDX-License-Identifier: GPL-3.0-or-later
"""`cache`: lists, prunes and verifies the cache of bakes."""

import argparse
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..bake.cache import NS_OF_A_DAY, Cache, Limits, Listed, State, damaged, default_folder, limits_set, listed
from ..base.failure import GratingError
from .arguments import add_json, number
from .printing import Progress, emit

_KEY_SHOWN = 12
# Entries that are listed within a second, also from a file server.
_LISTED_AT_ONCE = 100
_MOST_MIB, _MOST_DAYS = 1e9, 1e6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `cache`."""
    actions = parser.add_subparsers(required=True, metavar="list|prune|verify", parser_class=type(parser))
    add_list = actions.add_parser("list", help="the bakes in the cache, the last used first")
    add_list.set_defaults(act=_list)
    prune = actions.add_parser("prune", help="remove bakes that have been unused for longest; never one in use")
    prune.add_argument("--max-mb", type=number(0, _MOST_MIB), metavar="MIB", help="keep at most MIB of bakes")
    prune.add_argument("--max-days", type=number(0, _MOST_DAYS), metavar="D", help="keep bakes used in the last D days")
    prune.add_argument("--all", action="store_true", help="remove every bake")
    prune.add_argument("--dry-run", action="store_true", help="only print which bakes would go")
    prune.set_defaults(act=_prune)
    verify = actions.add_parser("verify", help="compare the files of every bake with its record and its key")
    verify.add_argument("--remove", action="store_true", help="remove the damaged bakes")
    verify.set_defaults(act=_verify)
    for each in (add_list, prune, verify):
        add_json(each)
        each.add_argument("--progress", choices=("text", "json", "none"), default="text", help=argparse.SUPPRESS)


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `cache` on the default folder."""
    run_in(default_folder(), arguments)


def run_in(folder: Path, arguments: argparse.Namespace) -> None:
    """Run the verb `cache` on the cache in a folder, which may be missing."""
    act: Callable[[Cache, argparse.Namespace], None] = arguments.act
    act(Cache(folder), arguments)


def _list(cache: Cache, arguments: argparse.Namespace) -> None:
    progress, entries = Progress(arguments.progress), list(cache.entries())
    found = []
    for count, entry in enumerate(sorted(entries, key=lambda entry: entry.unused_ns)):
        # A short list appears at once, without a line of progress.
        if count and count % _LISTED_AT_ONCE == 0:
            progress("listing", count / len(entries))
        found.append(listed(cache, entry))
    total = sum(entry.size_bytes for entry in entries)
    facts = {"folder": str(cache.folder), "bytes": total, "entries": [_facts_of(each) for each in found]}
    emit(facts, arguments.json, lambda: [*map(_line, found), f"{cache.folder}: {_bakes(len(found))}, {_mib(total)}"])


def _prune(cache: Cache, arguments: argparse.Namespace) -> None:
    limits = _limits_of(arguments)
    if not arguments.dry_run:
        _check_can_change(cache)
    before = {entry.key: listed(cache, entry) for entry in cache.entries()}
    gone = [before[entry.key] for entry in cache.evict(limits, dry_run=arguments.dry_run) if entry.key in before]
    freed = sum(each.entry.size_bytes for each in gone)
    facts = {
        "folder": str(cache.folder), "dry_run": arguments.dry_run, "bytes": freed,
        "kept": len(before) - len(gone), "removed": [_facts_of(each) for each in gone],
    }  # fmt: skip
    done = "would be removed" if arguments.dry_run else "removed"
    last = f"{cache.folder}: {_bakes(len(gone))}, {_mib(freed)} {done}; {len(before) - len(gone)} kept"
    emit(facts, arguments.json, lambda: [*map(_line, gone), last])


def _check_can_change(cache: Cache) -> None:
    """Raise GratingError if the user may not change the cache. A full disk is no hindrance to removing."""
    if cache.folder.is_dir() and not os.access(cache.folder, os.W_OK):
        raise GratingError(cache.folder, "cannot be changed by this user", "run this as a user who may write there")


def _limits_of(arguments: argparse.Namespace) -> Limits:
    if arguments.all:
        return Limits(size_bytes=-1)  # even an empty cache is larger
    if arguments.max_mb is None and arguments.max_days is None:
        return limits_set()
    size_mib = math.inf if arguments.max_mb is None else arguments.max_mb
    days = math.inf if arguments.max_days is None else arguments.max_days
    return Limits(size_mib * 2**20, days * NS_OF_A_DAY)


def _verify(cache: Cache, arguments: argparse.Namespace) -> None:
    if arguments.remove:
        _check_can_change(cache)
    entries = len(list(cache.entries()))
    found = list(damaged(cache, Progress(arguments.progress), remove=arguments.remove))
    facts = {
        "folder": str(cache.folder), "entries": entries,
        "damaged": [{**_facts_of(each), "removed": removed} for each, removed in found],
    }  # fmt: skip
    lines = [f"{_line(each)}{', removed' if removed else ''}" for each, removed in found]
    if not found or arguments.json:
        emit(facts, arguments.json, lambda: [_none_is_damaged(cache, entries)])
    else:
        emit(facts, None, lambda: lines)
    if found:
        is_ = "is" if len(found) == 1 else "are"
        all_removed = all(removed for _, removed in found)
        remedy = (
            "the damaged bakes are removed; the next bakes make them again" if all_removed else "run verify --remove"
        )
        raise GratingError(cache.folder, f"{len(found)} of {_bakes(entries)} {is_} damaged", remedy)


def _none_is_damaged(cache: Cache, entries: int) -> str:
    line = f"{cache.folder}: {_bakes(entries)}, none is damaged"
    others = sum(listed(cache, entry).state == State.OTHER_VERSION for entry in cache.entries())
    return f"{line}; {others} of another version, which only `cache prune` removes" if others else line


def _facts_of(each: Listed) -> Mapping[str, Any]:
    return {
        "key": each.entry.key, "name": each.name, "bytes": each.entry.size_bytes,
        "unused_days": each.entry.unused_ns / NS_OF_A_DAY,
        "delta_e_p99": None if math.isnan(each.p99) else each.p99, "state": str(each.state),
    }  # fmt: skip


def _line(each: Listed) -> str:
    error = "unknown" if math.isnan(each.p99) else f"{each.p99:.2f}"
    days = max(0.0, each.entry.unused_ns / NS_OF_A_DAY)
    return (
        f"{each.entry.key[:_KEY_SHOWN]}  {each.name or '?'}  {_mib(each.entry.size_bytes)}  "
        f"used {days:.1f} days ago  dE00 p99 {error}  {each.state}"
    )


def _bakes(count: int) -> str:
    return f"{count} bake{'' if count == 1 else 's'}"


def _mib(size_bytes: int) -> str:
    return f"{size_bytes / 2**20:.1f} MiB"
