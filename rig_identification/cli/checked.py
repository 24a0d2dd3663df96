"""The set-up for a terminal: first what is wrong and what to do, then what was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TextIO

from rich import box
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from rig_identification.cli.plain_numbers import plain_number
from rig_identification.examination import Examination
from rig_identification.report.setup import FaultView, SetupView, TopicView, setup_view

#: Columns where the output is no terminal, as in a file.
_WIDTH = 140


def print_examination(examination: Examination, stream: TextIO) -> None:
    """Print faults, warnings, readings at rest, topics and notes; names as they are, whatever they hold."""
    view = setup_view(examination)
    width = None if stream.isatty() else _WIDTH
    console = Console(file=stream, width=width, markup=False, highlight=False, emoji=False)
    style = "bold red" if view.faults else "bold yellow" if view.warnings else "bold green"
    console.print(Text(f"{examination.session}: {view.headline}", style))
    for number, fault in enumerate(view.faults, start=1):
        _print_fault(console, number, fault)
    for warning in view.warnings:
        console.print()
        console.print(Text.assemble(("warning: ", "yellow"), warning))
    if view.rest:
        console.print()
        console.print(_rest_table(view))
    console.print()
    console.print(_topic_table(view))
    for line in _unused(examination):
        console.print(line)
    for note in examination.notes:
        console.print(f"note: {note}")


def setup_lines(examination: Examination) -> Iterator[str]:
    """What a person has to know beside the ten numbers: each fault with what to change, and each warning."""
    for fault in setup_view(examination).faults:
        yield f"set-up: {fault.statement} {fault.advice}".rstrip()
        yield from (f"    {line}" for line in fault.correction.splitlines())
    for warning in examination.warnings:
        yield f"warning: {warning}"


def _print_fault(console: Console, number: int, fault: FaultView) -> None:
    console.print()
    console.print(Text.assemble((f"{number}. {fault.title}. ", "bold red"), fault.statement))
    if fault.advice:
        _print_indented(console, Text.assemble(("What to do: ", "bold"), fault.advice))
    for line in fault.correction.splitlines():  # to be copied: as long as it is
        console.print(Text(6 * " " + line), soft_wrap=True)
    for tie in fault.ties:
        _print_indented(console, Text(f"Or else, {tie.gap} nats less likely: {tie.statement}"))


def _print_indented(console: Console, text: Text) -> None:
    console.print(Padding(text, (0, 0, 0, 3), expand=False))


def _rest_table(view: SetupView) -> Table:
    corrected = ", with the faults above put right where they can be" if view.faults else ""
    columns = ("measured", "expected", "unit", "off by, σ")
    table = _table(f"Readings at rest{corrected}", ("recording", "reading"), columns)
    for row in view.rest:
        off = Text(plain_number(row.off), "bold red" if row.is_far else "")
        numbers = [Text(plain_number(text)) for text in (row.measured, row.expected)]
        table.add_row(Text(row.recording), Text(row.reading), *numbers, Text(row.unit), off)
    return table


def _topic_table(view: SetupView) -> Table:
    numbers = ("messages", "Hz", "from, s", "to, s", "gaps", "longest, s", "received after", "used")
    table = _table("Topics", ("recording", "topic", "type"), numbers)
    for recording, topics in view.topics:
        for index, topic in enumerate(topics):
            last = index + 1 == len(topics)
            table.add_row(Text("" if index else recording), *_cells(topic), end_section=last)
    return table


def _cells(topic: TopicView) -> list[Text]:
    numbers = (
        topic.count,
        topic.rate,
        topic.start,
        topic.end,
        str(topic.gaps),
        topic.longest_gap,
        topic.clock,
    )
    used = Text("yes") if topic.used else Text("no", "yellow")
    names = (topic.topic, topic.message_type.rpartition("/")[2])
    return [*map(Text, names), *(Text(plain_number(text)) for text in numbers), used]


def _unused(examination: Examination) -> Iterator[str]:
    """One line a topic that is not used, whatever the number of bags."""
    found: dict[tuple[str, str], list[str]] = {}
    for topic in examination.topics:
        if not topic.used:
            found.setdefault((topic.topic, topic.note), []).append(topic.recording)
    for (name, note), recordings in found.items():
        yield f"not used: {name} ({', '.join(recordings)}): {note}"


def _table(title: str, names: Sequence[str], numbers: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE, pad_edge=False, collapse_padding=True)
    for name in names:
        table.add_column(name, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)
    return table
