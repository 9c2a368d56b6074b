# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception whose text is meant for the user, and how text of others is shown."""

# Characters of a message that are shown. A path has at most 4096.
_LONGEST = 6000


class GratingError(Exception):
    """A failure that the user can do something about. Its text is one printable line: "WHAT: fault; remedy"."""

    def __init__(self, message: str) -> None:
        if len(message) > _LONGEST:
            message = f"{message[: _LONGEST - 1000]} [...] {message[-1000:]}"
        super().__init__(printable(message))


def printable(text: object) -> str:
    r"""A text as one line. Characters that move the cursor, turn the direction of writing or cannot be shown at all
    are written as escapes: \n, \x1b, \u202e.

    The names and the contents of files may hold such characters, and a terminal would obey them."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in str(text))
