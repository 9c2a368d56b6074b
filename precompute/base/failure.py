# SPDX-License-Identifier: GPL-3.0-or-later
"""The exception whose text is shown to the user, and a function that makes foreign text safe to print."""

# The longest message in characters. A path has at most 4096.
_LONGEST = 6000


class GratingError(Exception):
    """A failure that the user can fix. Its text is one printable line: "WHAT: fault; remedy"."""

    def __init__(self, message: str) -> None:
        if len(message) > _LONGEST:
            message = f"{message[: _LONGEST - 1000]} [...] {message[-1000:]}"
        super().__init__(printable(message))


def printable(text: object) -> str:
    r"""Return a text as one line, with unprintable characters as escapes: \n, \x1b, \u202e.

    File names and contents may hold control characters, which a terminal would obey."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in str(text))
