# SPDX-License-Identifier: GPL-3.0-or-later
"""The log of a job: a line of JSON for each event."""

import json
from datetime import UTC, datetime
from typing import Any, TextIO


class Log:
    """Writes events to a file, each as a line that is there at once: `time` in UTC, `event`, and its facts."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def __call__(self, event: str, **facts: Any) -> None:
        record = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": event, **facts}
        self._file.write(json.dumps(record) + "\n")
        self._file.flush()
