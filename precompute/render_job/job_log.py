# SPDX-License-Identifier: GPL-3.0-or-later
"""The log of a job: a line of JSON for each event."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ..base.files import told_of


class Log:
    """Appends events to a file, each as a line that is there at once: `time` in UTC, `event`, and its facts. Raises
    GratingError if it cannot be written."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with told_of(path):
            path.parent.mkdir(parents=True, exist_ok=True)

    def __call__(self, event: str, **facts: Any) -> None:
        record = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": event, **facts}
        with told_of(self._path), self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
