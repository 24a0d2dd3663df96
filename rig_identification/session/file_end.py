"""Where a file ends in truth."""

from __future__ import annotations

from pathlib import Path

_AT_ONCE = 1 << 16
_BLOCK = 512  # bytes, the smallest that disks write


def written_size(path: Path) -> int:
    """Bytes of a file, less a block of zeros at its end.

    A file system that lost power keeps a file's length and fills what it did not write with zeros. A bag that
    was closed ends in a few of them at most.
    """
    size = end = path.stat().st_size
    with path.open("rb") as file:
        while end > 0:
            start = max(0, end - _AT_ONCE)
            file.seek(start)
            if rest := file.read(end - start).rstrip(b"\0"):
                written = start + len(rest)
                return written if size - written >= _BLOCK else size
            end = start
    return 0
