"""The report's HTML: one file that needs no other, its pictures inside."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources

import numpy as np

from experiments.recorders import palette
from experiments.sweeping.groups import Column, Group, columns_for
from experiments.sweeping.jobs import CRASHED, Row


@dataclass(frozen=True)
class Shown:
    """A single run as the page shows it."""

    row: Row
    series: str
    why: str
    """What is bad about it."""
    picture: bytes = b""
    links: Mapping[str, str] | None = None
    """Address of each file of its recording, relative to the page."""

    @property
    def title(self) -> str:
        return f"{self.row.get('name', '?')} {self.row.get('seed', '')}"


def page(title: str, sections: Iterable[str]) -> str:
    """A whole HTML document."""
    style = resources.files("experiments.reporting").joinpath("page.css").read_text()
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(sections)
        + "\n</main>\n</body>\n</html>\n"
    )


def heading(title: str, text: str) -> str:
    return f"<header><h1>{escape(title)}</h1><p class='soft'>{escape(text)}</p></header>"


def tiles(figures: Iterable[tuple[str, str, str]]) -> str:
    """The few numbers to begin with: (number, what it is, good, bad or nothing)."""
    cells = (
        f"<div class='tile {mood}'><b>{escape(number)}</b><span class='soft'>{escape(what)}</span></div>"
        for number, what, mood in figures
    )
    return f"<div class='tiles'>{''.join(cells)}</div>"


def section(title: str, text: str, body: str) -> str:
    """A part of the page; the text explains what is to be seen."""
    return f"<section><h2>{escape(title)}</h2><p class='soft'>{text}</p>{body}</section>"


def group_table(groups: Sequence[Group]) -> str:
    """A line per kind and series; of each kind the least metres stand out."""
    columns = columns_for(groups)
    titles = "".join(f"<th title='{escape(c.meaning, quote=True)}'>{escape(c.title)}</th>" for c in columns)
    head = f"<tr><th class='name'>building</th><th class='name'>run as</th>{titles}</tr>"
    lines, before = [], ""
    for group in groups:
        best = _least_metres([other for other in groups if other.kind == group.kind])
        cells = "".join(_cell(column, group, group is best) for column in columns)
        is_first = "first" if group.kind != before else ""
        kind = escape(group.kind) if is_first else ""
        names = f"<td class='name'>{kind}</td><td class='name'>{escape(group.series)}</td>"
        lines.append(f"<tr class='{is_first}'>{names}{cells}</tr>")
        before = group.kind
    return _table(head, "".join(lines))


def _table(head: str, lines: str) -> str:
    return f"<div class='sheet'><table><thead>{head}</thead><tbody>{lines}</tbody></table></div>"


def _least_metres(groups: Sequence[Group]) -> Group | None:
    """The group that drove least of those that always came to the end, if there is any choice."""
    driven = [group for group in groups if group.runs == group.complete]
    return min(driven, key=lambda group: float(np.median(group["metres"]))) if len(driven) > 1 else None


def _cell(column: Column, group: Group, is_best: bool) -> str:
    falls_short = column.title in ("complete", "honest") and column.text(group) != str(group.runs)
    has_hits = column.title == "hits" and column.text(group) not in ("0", "-")
    mark = "short" if falls_short or has_hits else "best" if is_best and column.title == "metres" else ""
    return f"<td class='{mark}'>{escape(column.text(group))}</td>"


def picture(png: bytes, meaning: str) -> str:
    """A figure, inlined."""
    return f"<figure>{_image(png, meaning)}</figure>"


def failure_table(failures: Sequence[Shown], more: int = 0) -> str:
    """A line per failure; `more` are not listed."""
    titles = ("building", "seed", "run as", "what is wrong", "metres", "recording")
    head = "".join(f"<th class='name'>{title}</th>" for title in titles)
    lines = "".join(map(_failure, failures))
    rest = f"<p class='soft'>and {more} more</p>" if more else ""
    return _table(f"<tr>{head}</tr>", lines) + rest


def _failure(shown: Shown) -> str:
    row = shown.row
    texts = (str(row.get("name", "?")), str(row.get("seed", "")), shown.series)
    names = "".join(f"<td class='name'>{escape(text)}</td>" for text in texts)
    metres = "-" if row["status"] == CRASHED else f"{row['path_length_m']:.0f}"
    why = f"<td class='why'>{escape(shown.why)}</td>"
    return f"<tr>{names}{why}<td class='name'>{metres}</td><td class='name'>{_links(shown) or '-'}</td></tr>"


def gallery(runs: Sequence[Shown]) -> str:
    """A card per run."""
    cards = []
    for shown in runs:
        image = _image(shown.picture, f"map of {shown.title}") if shown.picture else "no map"
        lines = [f"<b>{escape(shown.title)}</b> {escape(shown.series)}", escape(shown.why), _links(shown)]
        text = "<br>".join(line for line in lines if line)
        cards.append(f"<div class='card'><div class='map'>{image}</div><div class='text'>{text}</div></div>")
    return f"<div class='gallery'>{''.join(cards)}</div>"


def map_key() -> str:
    """What the colours of the small maps mean."""
    meaning = {
        "free": palette.FREE,
        "occupied": palette.OCCUPIED,
        "unknown": palette.UNKNOWN,
        "could have been explored": palette.GOAL,
        "driven": palette.TRAIL,
    }
    return (
        "<span class='key'>"
        + "".join(f"<span style='background: rgb{rgb}'></span>{name}" for name, rgb in meaning.items())
        + "</span>"
    )


def _links(shown: Shown) -> str:
    links = (shown.links or {}).items()
    return ", ".join(f"<a href='{escape(place, quote=True)}'>{escape(name)}</a>" for name, place in links)


def _image(png: bytes, meaning: str) -> str:
    data = base64.b64encode(png).decode()
    return f"<img alt='{escape(meaning, quote=True)}' src='data:image/png;base64,{data}'>"
