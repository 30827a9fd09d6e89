"""Log lines that wait to be written, limited per kind."""

from collections import Counter

from crcolony_dashboards.view_model.log_lines import LogLine

_MAX_LINES = 8
"""Of one kind between two writes, which are a second apart"""


class LogBuffer:
    """Keeps the first lines of every kind, and counts the others."""

    def __init__(self) -> None:
        self._lines: list[LogLine] = []
        self._counts: Counter[str] = Counter()

    def add(self, line: LogLine) -> None:
        """Add a line, or only count it if there are too many of its kind."""
        self._counts[line.kind] += 1
        if self._counts[line.kind] <= _MAX_LINES:
            self._lines.append(line)

    def pop_lines(self) -> list[LogLine]:
        """Return the lines since the last call, and one line for every kind of which some were left out."""
        lines, self._lines = self._lines, []
        for kind, count in self._counts.items():
            if count > _MAX_LINES:
                lines.append(LogLine(kind, f"… and {count - _MAX_LINES} more ({kind})"))
        self._counts.clear()
        return lines
