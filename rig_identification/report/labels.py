"""Labels of a drawing that do not lie on each other."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

#: px of the page's style: width of a letter on average, height of a line.
LETTER, LINE = 6.6, 13.0
#: px within which points look like one: their labels are written as one.
SAME = 12.0

Box = tuple[float, float, float, float]  # left, top, right, bottom


@dataclass(frozen=True)
class Label:
    """A text beside a point of the drawing."""

    text: str
    x: float  # px
    y: float
    faulty: bool = False


@dataclass(frozen=True)
class Placed:
    """A label where it is written: ``x`` is its middle."""

    text: str
    x: float
    y: float  # of the baseline
    faulty: bool

    @property
    def box(self) -> Box:
        """What it covers."""
        half = 0.5 * LETTER * len(self.text)
        return self.x - half, self.y - 0.8 * LINE, self.x + half, self.y + 0.2 * LINE

    @property
    def svg(self) -> str:
        """The text as an element."""
        return f'<text class="mid" x="{self.x:.1f}" y="{self.y:.1f}">{escape(self.text)}</text>'


def merged(labels: list[Label]) -> list[Label]:
    """Labels of points that lie on each other as one; what is at fault keeps its own."""
    out: list[Label] = []
    for label in labels:
        for i, other in enumerate(out):
            near = abs(label.x - other.x) < SAME and abs(label.y - other.y) < SAME
            if near and not label.faulty and not other.faulty:
                out[i] = Label(f"{other.text}, {label.text}", other.x, other.y)
                break
        else:
            out.append(label)
    return out


def placed(labels: list[Label], width: float, height: float, taken: list[Box] | None = None) -> list[Placed]:
    """Write each label beside its point, within the drawing, where it covers no other one.

    What is at fault chooses first. taken: what no label may cover. Where no place is free the one is taken
    that covers least.
    """
    boxes, out = list(taken or []), []
    for label in sorted(merged(labels), key=lambda one: not one.faulty):
        places = _places(label, width, height)
        best = min(places, key=lambda place: sum(_common(place.box, box) for box in boxes))
        boxes.append(best.box)
        out.append(best)
    return out


def _places(label: Label, width: float, height: float) -> list[Placed]:
    """Where a label may be written, best first: above its point, right, left, below, then a line further."""
    half = 0.5 * LETTER * len(label.text)
    offsets = [(0.0, -7.0), (half + 9.0, 4.0), (-half - 9.0, 4.0), (0.0, 18.0)]
    offsets += [(side * (half + 9.0), k * LINE) for k in (-1.3, 1.3, -2.3, 2.3) for side in (1.0, -1.0)]
    offsets += [(0.0, -7.0 - k * LINE) for k in range(1, 4)] + [(0.0, 18.0 + k * LINE) for k in range(1, 4)]
    return [
        Placed(
            label.text,
            min(max(label.x + dx, half + 1.0), max(width - half - 1.0, half + 1.0)),
            min(max(label.y + dy, LINE), height - 4.0),
            label.faulty,
        )
        for dx, dy in offsets
    ]


def _common(one: Box, other: Box) -> float:
    """Area that two boxes share."""
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    return max(across, 0.0) * max(down, 0.0)
