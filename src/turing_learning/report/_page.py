"""Pages: one file each, nothing loaded from outside, everything that comes from the user escaped."""

import base64
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from string import Template

import numpy as np

from turing_learning._files import write_atomically
from turing_learning.analysis import Judgment
from turing_learning.figures import Picture

from ._replay import ITEM_LOOKS, Replay
from .tabular import aligned, counted, has_errors

GENERATOR = "Turing Learning for Python"
"""By which a page is recognized."""
HEAD_BYTES = 2048
"""Bytes of a page within which it says so."""
POSE_STEPS = 65535
"""Of a coordinate over the view, or of a heading over one turn, in 16 bits."""
NOTHING = "&ndash;"
"""Stands in a cell without a number, as markup."""
ACTIVE = "active"
MOST_SPANS = 6
"""Spans of generations that are listed one by one, at most."""

Cell = str | float | int | None
"""A text, a number, or None where there is nothing."""


@dataclass(frozen=True)
class Listing:
    """A table with a heading, of rows with one cell for each column."""

    name: str  # makes its ids unique in the page: lower-case letters
    heading: str
    columns: Sequence[str]  # headings; the first column names the row
    rows: Sequence[Sequence[Cell]]
    note: str = ""  # what a reader needs to read it
    # Whether it is closed until it is asked for, because it is long
    folded: bool = False
    foot: Sequence[Cell] = ()  # a last row, set apart
    # Heading of a column -> "strong" or "apart"
    looks: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Report:
    """A run, a study or a detection as a reader should see it; what is empty or None is left out."""

    title: str
    summary: str  # the result in one sentence
    listings: Sequence[Listing]  # folded ones come after the figures
    figures: Sequence[Picture] = ()
    warning: str = ""  # what a reader must not miss
    doubts: Sequence[str] = ()  # what looks odd, a sentence each
    # As text (TOML): the resolved one, of a study that of the first run
    configuration: str = ""
    judgment: Judgment | None = None  # whether to believe a run
    # Names and values that belong at the top: seed, date, command, citation
    facts: Sequence[tuple[str, str]] = ()
    # Name of a file -> its content, for download
    data: Mapping[str, str] = field(default_factory=dict)
    check: Listing | None = None
    check_figures: Sequence[Picture] = ()
    # What to do next: commands, and what they are for
    steps: Sequence[tuple[str, str]] = ()
    methods: str = ""  # what a paper says of the run in its section on methods
    replay: Replay | None = None
    # Names and values: versions, machine, timing
    manifest: Sequence[tuple[str, str]] = ()


def report_page(report: Report) -> str:
    """Return one HTML page that works offline: its Content-Security-Policy forbids it to load anything."""
    sections = []
    if report.judgment is not None:
        sections.append(_verdict(report.judgment))
    if report.facts:
        sections.append(f'<dl class="top">{_facts(report.facts)}</dl>')
    sections += map(_warning, report.doubts)
    # what is folded stands below the figures
    folded = []
    for listing in report.listings:
        if listing.folded:
            folded.append(_listing(listing))
        else:
            sections.append(_listing(listing))
    if report.data:
        sections.append(f'<p class="note">Data: {_downloads(report.data)}</p>')
    if report.warning:
        sections.append(_warning(report.warning))
    if report.judgment is not None:
        sections.append(asset("_reading.html"))
    if report.check is not None:
        sections.append(_listing(report.check) + _figures(report.check_figures))
    if report.steps:
        sections.append(_section("next", "Next steps", f"<ul>{_steps(report.steps)}</ul>"))
    if report.replay is not None:
        sections.append(_replay(report.replay))
    if report.figures:
        sections.append(_section("figures", "Figures", _figures(report.figures)))
    sections += folded
    if report.methods:
        text = (
            f'<p class="copied" title="One click selects all of it.">{escape(report.methods)}</p>'
        )
        sections.append(_folded("methods", "Text for a section on methods", text))
    if report.configuration:
        code = f"<pre><code>{escape(report.configuration)}</code></pre>"
        sections.append(_folded("configuration", "Configuration", code))
    if report.manifest:
        table = _scroll("Manifest", _manifest(report.manifest))
        sections.append(_folded("manifest", "Manifest", table))
    return _page(report.title, report.summary, sections, report.replay)


def _facts(facts: Iterable[tuple[str, str]]) -> str:
    markup = ""
    for name, value in facts:
        markup += f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>"
    return markup


def _downloads(data: Mapping[str, str]) -> str:
    links = []
    for name, text in data.items():
        coded = base64.b64encode(text.encode()).decode()
        links.append(
            f'<a download="{escape(name)}" href="data:text/csv;base64,{coded}">{escape(name)}</a>'
        )
    return ", ".join(links)


def _steps(steps: Iterable[tuple[str, str]]) -> str:
    items = ""
    for command, purpose in steps:
        items += f"<li>{escape(purpose)}<pre><code>{escape(command)}</code></pre></li>"
    return items


def _manifest(entries: Iterable[tuple[str, str]]) -> str:
    rows = []
    for name, value in entries:
        rows.append(f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>')
    return '<table class="facts"><tbody>' + "\n".join(rows) + "</tbody></table>"


def describe_selection(selection: Sequence[str]) -> str:
    """Say in which generations all models were equally fit, "all accepted" or "all rejected"; nothing if all were "active".

    >>> describe_selection(["active", "all rejected", "all rejected"])
    'Selection stopped in 2 of 3 generations: 1 to 2 (all rejected).'
    """
    stopped = sum(state != ACTIVE for state in selection)
    if not stopped:
        return ""
    spans = []
    begin = 0
    for state, group in groupby(selection):
        stop = begin + sum(1 for _ in group) - 1
        if state != ACTIVE:
            span = str(begin) if begin == stop else f"{begin} to {stop}"
            spans.append(f"{span} ({state})")
        begin = stop + 1
    listing = ", ".join(spans[:MOST_SPANS])
    if len(spans) > MOST_SPANS:
        listing += f", and {len(spans) - MOST_SPANS} more times"
    return f"Selection stopped in {stopped} of {len(selection)} generations: {listing}."


def replay_page(replay: Replay, title: str | None = None) -> str:
    """Return an HTML page with nothing but a replay; it works offline.

    Parameters
    ----------
    replay
        What to show.
    title
        Title of the page; the replay's own by default.
    """
    # The heading of the page is enough, unless it says something else.
    heading = bool(title) and title != replay.title
    return _page(title or replay.title, "", [_replay(replay, heading=heading)], replay)


def write_page(page: str, path: str | Path) -> Path:
    """Write a page to a file, which appears complete or not at all.

    Parameters
    ----------
    page
        The page.
    path
        The file, in an existing folder; one that exists is replaced.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_atomically(Path(path), page.encode("utf-8", "xmlcharrefreplace"))
    return Path(path)


def is_page(path: Path, mark: str = f'<meta name="generator" content="{GENERATOR}">') -> bool:
    """Return whether a file is a page that has been written here, by what stands near its beginning."""
    with path.open("rb") as file:
        return mark.encode() in file.read(HEAD_BYTES)


@cache
def asset(name: str) -> str:
    """Return a text file of this room."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _verdict(judgment: Judgment) -> str:
    """Return whether to believe the result, as a banner."""
    meaning = re.sub("`(.*?)`", r"<code>\1</code>", escape(judgment.meaning))
    word = f"<b>{escape(judgment.verdict)}</b> <span>{meaning}</span>"
    return f'<p class="judged {judgment.look}" id="verdict">{word}</p>'


def _page(title: str, summary: str, sections: list[str], replay: Replay | None) -> str:
    script = asset("_replay.js") if replay is not None else ""
    if any(" data-axes=" in section for section in sections):
        script += asset("_curves.js")
    data = _embed(replay) if replay is not None else "null"
    return page_of(title, summary, sections, script, data)


def page_of(title: str, summary: str, sections: Sequence[str], script: str, data: str) -> str:
    """Return a page of sections, which are markup already, with one script and the data (JSON) that it reads."""
    # The page's policy allows this one script, by its hash, and no other.
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    paragraph = ""
    if summary:
        paragraph = f'<p class="summary">{escape(summary)}</p>'
    return Template(asset("_page.html")).substitute(
        generator=GENERATOR,
        policy=f"'sha256-{digest}'",
        title=escape(title),
        style=asset("_style.css"),
        summary=paragraph,
        sections="\n".join(filter(None, sections)),
        data=data,
        script=script,
    )


def _warning(text: str) -> str:
    return f'<p class="health warning" role="note">{escape(text)}</p>'


def _section(name: str, heading: str, body: str) -> str:
    """Return a part of a page under a heading; the texts are markup already."""
    title = f'<h2 id="{name}-heading">{heading}</h2>'
    return f'<section id="{name}" aria-labelledby="{name}-heading">{title}\n{body}</section>'


def _folded(name: str, heading: str, body: str) -> str:
    return f'<details id="{name}"><summary>{heading}</summary>{body}</details>'


def _scroll(label: str, body: str) -> str:
    """Return markup that can be wider than the page."""
    return f'<div class="scroll" tabindex="0" role="region" aria-label="{label}">{body}</div>'


def _listing(listing: Listing) -> str:
    """Return a table as markup."""
    head = _row(map(escape, listing.columns), listing, ["col"] * len(listing.columns), strong=False)
    # The foot is aligned with the rows.
    rows = list(listing.rows)
    if listing.foot:
        rows.append(listing.foot)
    columns = list(map(_column, listing.columns, zip(*rows, strict=True)))
    scopes = ["row"] + [""] * (len(listing.columns) - 1)
    lines = []
    foot = ""
    for k, cells in enumerate(zip(*columns, strict=True)):
        if k < len(listing.rows):
            lines.append(_row(cells, listing, scopes, strong=True))
        else:
            foot = f"\n<tfoot>{_row(cells, listing, scopes, strong=False)}</tfoot>"
    body = "\n".join(lines)
    table = f'<table class="numbers"><thead>{head}</thead>\n<tbody>{body}</tbody>{foot}</table>'
    note = ""
    if listing.note:
        note = f'<p class="note">{escape(listing.note)}</p>'
    heading = escape(listing.heading)
    put = _folded if listing.folded else _section
    return put(escape(listing.name), heading, _scroll(heading, table) + note)


def _row(cells: Iterable[str], listing: Listing, scopes: Sequence[str], *, strong: bool) -> str:
    """Return a row of markup; cells with a scope are headings. Columns that stand apart do so in every row."""
    markup = ""
    for heading, cell, scope in zip(listing.columns, cells, scopes, strict=True):
        look = listing.looks.get(heading, "")
        style = ""
        if look == "apart" or (look and strong):
            style = f' class="{look}"'
        if scope:
            markup += f'<th scope="{scope}"{style}>{cell}</th>'
        else:
            markup += f"<td{style}>{cell}</td>"
    return f"<tr>{markup}</tr>"


def _column(heading: str, cells: Sequence[Cell]) -> list[str]:
    """Return the cells of a column as markup, its numbers aligned."""
    markup = [escape(str(cell)) for cell in cells]
    numeric = [k for k, cell in enumerate(cells) if cell is None or isinstance(cell, float)]
    # Integers count things: they need no point to be aligned at.
    values = [cells[k] for k in numeric]
    numbers = aligned(values, NOTHING, rough=has_errors(heading))  # type: ignore[arg-type]
    for k, number in zip(numeric, numbers, strict=True):
        markup[k] = number
    return markup


def _figures(figures: Iterable[Picture]) -> str:
    markup = ""
    for figure in figures:
        title = escape(figure.title)
        caption = f" {escape(figure.caption)}" if figure.caption else ""
        words = f"<figcaption><b>{title}</b>{caption}</figcaption>"
        wide = " wide" if figure.wide else ""
        markup += f'<figure class="plot{wide}">{words}{_scroll(title, figure.svg)}</figure>\n'
    return f'<div class="figures">{markup}</div>'


def _replay(replay: Replay, heading: bool = True) -> str:
    stages = ""
    for swarm in replay.swarms:
        individual = "agent" if replay.robotic else "individual"
        legend = ""
        for look, noun, count in (
            ("agent", individual, np.sum(~swarm.is_replica)),
            ("replica", "replica", np.sum(swarm.is_replica)),
            ("object", "object", replay.objects_of(swarm)),
        ):
            if count:
                legend += f'<span class="key {look}">{counted(count, noun)}</span>'
        for k, item in enumerate(replay.items):
            look = ITEM_LOOKS[k % len(ITEM_LOOKS)]
            text = f"{item.count} {escape(item.name)}"
            legend += f'<span class="key {look}">{text}</span>'
        stages += (
            f'<figure class="stage"><figcaption><b>{escape(swarm.label)}</b>{legend}</figcaption>'
            f'<canvas role="img" aria-label="{escape(swarm.label)}, seen from above"></canvas></figure>\n'
        )
    body = Template(asset("_replay.html")).substitute(
        stages=stages,
        count=len(replay.swarms),
        duration=f"{replay.duration_s:.1f}",
        sight="" if replay.robotic else "hidden",
    )
    if heading:
        return _section("replay", escape(replay.title), body)
    return f'<section id="replay" aria-label="Replay">{body}</section>'


def _embed(replay: Replay) -> str:
    """Return a replay as JSON; poses as integers of 16 bits, shares of the view and of a turn."""
    left, bottom, right, top = replay.view_cm
    swarms = []
    for swarm in replay.swarms:
        shares = (swarm.poses - (left, bottom, 0)) / (right - left, top - bottom, 2 * np.pi)
        # Headings may have turned several times.
        shares[..., 2] %= 1
        steps = np.rint(shares * POSE_STEPS).astype("<u2").tobytes()
        swarms.append(
            {
                "robots": swarm.robots,
                "bodies": shares.shape[1],
                "replicas": swarm.is_replica.astype(int).tolist(),
                "poses": base64.b64encode(steps).decode(),
            }
        )
    items = []
    for k, item in enumerate(replay.items):
        items.append(
            {
                "count": item.count,
                "radius": item.radius_cm,
                "visible": item.visible,
                "color": ITEM_LOOKS[k % len(ITEM_LOOKS)],
            }
        )
    data = {
        "interval": replay.interval_s,
        "frames": replay.frames,
        "robotRadius": replay.robot_radius_cm,
        "objectRadius": replay.object_radius_cm,
        "items": items,
        "view": replay.view_cm,
        "walls": replay.walls_cm,
        "swarms": swarms,
    }
    return json.dumps(data, allow_nan=False).replace("<", "\\u003c")
