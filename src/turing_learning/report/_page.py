"""Pages: one file each, nothing loaded from outside, everything that comes from the user escaped."""

import base64
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from turing_learning._files import whole
from turing_learning.analysis import Verdict
from turing_learning.figures import Picture

from ._content import Cell, Listing, RunReport, RunTable, StudyReport, describe_selection
from ._replay import Replay, Swarm
from ._tabular import aligned, shown

GENERATOR = "Turing Learning for Python"
"""By which a page is known."""
HEAD = 2048  # bytes of a page, within which it says so
STEPS = 65535  # of a pose's coordinate, over the view or one turn
NOTHING = "&ndash;"
"""Stands in a cell without a number, as markup."""


def report_page(report: RunReport) -> str:
    """Return a run as one HTML page that works offline: its Content-Security-Policy forbids it to load anything."""
    stopped = describe_selection(report.selection)
    health = f'<p class="health warning" role="note">{escape(stopped)} Many of them near the end make the result doubtful.</p>'
    check = "" if report.check is None else _listing(report.check) + _figures(report.check_figures)
    sections = [
        _verdict(report.verdicts),
        _facts(report.facts),
        _parameters(report.table),
        _downloads(report.data),
        health if stopped else "",
        _asset("_reading.html"),
        check,
        _steps(report.steps),
        _replay(report.replay) if report.replay is not None else "",
        _section("figures", "Figures", _figures(report.figures)) if report.figures else "",
        _configuration(report.configuration),
        _manifest(report.manifest),
    ]
    return _page(report.title, report.summary, sections, report.replay)


def study_page(report: StudyReport) -> str:
    """Return a study as one HTML page that works offline: its Content-Security-Policy forbids it to load anything."""
    sections = [
        *(_listing(listing) for listing in report.listings if not listing.folded),
        f'<p class="health warning" role="note">{escape(report.warning)}</p>' if report.warning else "",
        _section("figures", "Figures", _figures(report.figures)) if report.figures else "",
        *(_listing(listing) for listing in report.listings if listing.folded),
        _configuration(report.configuration),
    ]
    return _page(report.title, report.summary, sections, None)


def replay_page(replay: Replay, title: str | None = None) -> str:
    """Return an HTML page with nothing but a replay; it works offline.

    Parameters
    ----------
    replay
        What to show.
    title
        Title of the page; the replay's own by default.
    """
    return _page(title or replay.title, "", [_replay(replay, heading=bool(title) and title != replay.title)], replay)


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
    path = Path(path)
    with whole(path) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="xmlcharrefreplace")
    return path


def is_page(path: Path) -> bool:
    """Return whether a file is a page that has been written here."""
    with path.open("rb") as file:
        return f'<meta name="generator" content="{GENERATOR}">'.encode() in file.read(HEAD)


@cache
def _asset(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _verdict(verdicts: tuple[Verdict, ...]) -> str:
    """Return whether to believe the result, as a banner."""
    if not verdicts:
        return ""
    first, *others = verdicts
    look = {"converged": "good", "model rejected": "bad"}.get(first, "warning")
    also = f" Also: {escape(', '.join(others))}." if others else ""
    meaning = re.sub("`(.*?)`", r"<code>\1</code>", escape(first.meaning))
    return f'<p class="judged {look}" id="verdict"><b>{escape(first)}</b> <span>{meaning}{also}</span></p>'


def _facts(facts: Sequence[tuple[str, str]]) -> str:
    entries = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in facts)
    return f'<dl class="top">{entries}</dl>' if facts else ""


def _downloads(data: Mapping[str, str]) -> str:
    links = (
        f'<a download="{escape(name)}" href="data:text/csv;base64,{base64.b64encode(text.encode()).decode()}">{escape(name)}</a>'
        for name, text in data.items()
    )
    return f'<p class="note">Data: {", ".join(links)}</p>' if data else ""


def _steps(steps: Sequence[tuple[str, str]]) -> str:
    rows = "".join(f"<li>{escape(why)}<pre><code>{escape(command)}</code></pre></li>" for command, why in steps)
    return _section("next", "Next steps", f"<ul>{rows}</ul>") if steps else ""


def _page(title: str, summary: str, sections: list[str], replay: Replay | None) -> str:
    script = _asset("_replay.js") if replay is not None else ""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return Template(_asset("_page.html")).substitute(
        generator=GENERATOR,
        policy=f"'sha256-{digest}'",
        title=escape(title),
        style=_asset("_style.css"),
        summary=f'<p class="summary">{escape(summary)}</p>' if summary else "",
        sections="\n".join(section for section in sections if section),
        data=_embed(replay) if replay is not None else "null",
        script=script,
    )


def _section(name: str, heading: str, body: str) -> str:
    """Return a part of a page under a heading; the texts are markup already."""
    title = f'<h2 id="{name}-heading">{heading}</h2>'
    return f'<section id="{name}" aria-labelledby="{name}-heading">{title}\n{body}</section>'


def _parameters(table: RunTable) -> str:
    """Return the table of inferred parameters; columns of which nothing is known are left out."""
    there = {
        name: any(getattr(row, name) is not None for row in table.rows)
        for name in ("truth", "published_error", "interval")
    }

    def column(name: str, mean: float | None = None) -> tuple[list[str], str]:
        *cells, below = aligned([*(getattr(row, name) for row in table.rows), mean], NOTHING)
        return cells, below if mean is not None else ""

    lows, highs = zip(*(row.interval or (None, None) for row in table.rows), strict=True) if table.rows else ((), ())
    both = aligned([*lows, *highs], NOTHING)
    pairs = zip(both[: len(lows)], both[len(lows) :], strict=True)
    ends = [NOTHING if NOTHING in pair else " to ".join(pair) for pair in pairs]
    columns = {  # heading and whether it is there -> class, cells of the rows, cell below
        ("Inferred", True): ("strong", *column("estimate")),
        ("90 % interval", there["interval"]): ("", ends, ""),
        ("True", there["truth"]): ("", *column("truth")),
        ("Absolute error", there["truth"]): ("", *column("estimate_error", table.estimate_mae)),
        ("Paper&rsquo;s error", there["published_error"]): (
            "", [shown(row.published_error, "{:g}".format, NOTHING) for row in table.rows], ""
        ),
        ("Best model", True): ("apart", *column("best_model")),
        ("Absolute error ", there["truth"]): ("", *column("best_model_error", table.best_model_mae)),
    }  # fmt: skip
    head, mean, rows = "", "", [f'<th scope="row">{escape(row.name)}</th>' for row in table.rows]
    for (heading, known), (kind, cells, below) in columns.items():
        if known:
            apart = ' class="apart"' if kind == "apart" else ""
            head += f'<th scope="col"{apart}>{heading.strip()}</th>'
            mean += f"<td{apart}>{below}</td>"
            look = f' class="{kind}"' if kind else ""
            rows = [f"{row}<td{look}>{cell}</td>" for row, cell in zip(rows, cells, strict=True)]
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    foot = f'<tfoot><tr><th scope="row">Mean</th>{mean}</tr></tfoot>'
    if not there["truth"] or table.estimate_mae is None:
        foot = ""
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return _section(
        "result",
        "Inferred parameters",
        f'<div class="scroll" tabindex="0" role="region" aria-labelledby="result-heading"><table class="numbers">'
        f'<thead><tr><th scope="col">Parameter</th>{head}</tr></thead>\n<tbody>{body}</tbody>\n{foot}</table></div>{note}',
    )


def _listing(listing: Listing) -> str:
    """Return a table as markup."""

    def column(cells: Sequence[Cell]) -> list[str]:
        numbers = iter(aligned([each for each in cells if each is None or isinstance(each, float)], NOTHING))
        return [next(numbers) if each is None or isinstance(each, float) else escape(str(each)) for each in cells]

    header = "".join(f'<th scope="col">{escape(column)}</th>' for column in listing.columns)
    rows = []
    for head, *rest in zip(*map(column, zip(*listing.rows, strict=True)), strict=True):
        cells = "".join(f"<td>{cell}</td>" for cell in rest)
        rows.append(f'<tr><th scope="row">{head}</th>{cells}</tr>')
    name, heading, body = escape(listing.name), escape(listing.heading), "\n".join(rows)
    note = f'<p class="note">{escape(listing.note)}</p>' if listing.note else ""
    table = (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{heading}"><table class="numbers">'
        f"<thead><tr>{header}</tr></thead>\n<tbody>{body}</tbody></table></div>{note}"
    )
    if listing.folded:
        return f'<details id="{name}"><summary>{heading}</summary>{table}</details>'
    return _section(name, heading, table)


def _figures(figures: Iterable[Picture]) -> str:
    markup = ""
    for figure in figures:
        title, caption = escape(figure.title), f" {escape(figure.caption)}" if figure.caption else ""
        markup += (
            f'<figure class="plot{" wide" if figure.wide else ""}"><figcaption><b>{title}</b>{caption}</figcaption>'
            f'<div class="scroll" tabindex="0" role="region" aria-label="{title}">{figure.svg}</div></figure>\n'
        )
    return f'<div class="figures">{markup}</div>'


def _configuration(text: str) -> str:
    code = f"<pre><code>{escape(text)}</code></pre>"
    return f'<details id="configuration"><summary>Configuration</summary>{code}</details>' if text else ""


def _manifest(manifest: Sequence[tuple[str, str]]) -> str:
    rows = "\n".join(
        f'<tr><th scope="row">{escape(str(name))}</th><td>{escape(str(value))}</td></tr>' for name, value in manifest
    )
    table = f'<table class="facts"><tbody>{rows}</tbody></table>'
    scroll = f'<div class="scroll" tabindex="0" role="region" aria-label="Manifest">{table}</div>'
    return f'<details id="manifest"><summary>Manifest</summary>{scroll}</details>' if manifest else ""


def _replay(replay: Replay, heading: bool = True) -> str:
    stages = ""
    for swarm in replay.swarms:
        replicas = int(swarm.is_replica.sum())
        genuine = "agent" if replay.robotic else "individual"
        counts = {genuine: swarm.robots - replicas, "replica": replicas, "object": swarm.objects}
        legend = "".join(
            f'<span class="key {"agent" if kind == genuine else kind}">{count} {kind}{"s" if count != 1 else ""}</span>'
            for kind, count in counts.items()
            if count
        )
        stages += (
            f'<figure class="stage"><figcaption><b>{escape(swarm.label)}</b>{legend}</figcaption>'
            f'<canvas role="img" aria-label="{escape(swarm.label)}, seen from above"></canvas></figure>\n'
        )
    body = Template(_asset("_replay.html")).substitute(
        stages=stages,
        count=len(replay.swarms),
        duration=f"{replay.duration_s:.1f}",
        sight="" if replay.robotic else "hidden",
    )
    if heading:
        return _section("replay", escape(replay.title), body)
    return f'<section id="replay" aria-label="Replay">{body}</section>'


def _embed(replay: Replay) -> str:
    data = {
        "interval": replay.interval_s,
        "frames": replay.frames,
        "robotRadius": replay.robot_radius_cm,
        "objectRadius": replay.object_radius_cm,
        "view": replay.view_cm,
        "walls": replay.walls_cm,
        "swarms": [_embed_swarm(swarm, replay.view_cm) for swarm in replay.swarms],
    }
    return json.dumps(data, allow_nan=False).replace("<", "\\u003c")


def _embed_swarm(swarm: Swarm, view: tuple[float, float, float, float]) -> dict[str, Any]:
    left, bottom, right, top = view
    turns = swarm.poses[:, :, 2] / (2 * np.pi)
    parts = np.stack(
        [
            (swarm.poses[:, :, 0] - left) / (right - left),
            (swarm.poses[:, :, 1] - bottom) / (top - bottom),
            turns - np.floor(turns),
        ],
        axis=-1,
    )
    steps = np.rint(parts * STEPS).astype("<u2")
    return {
        "robots": swarm.robots,
        "bodies": swarm.poses.shape[1],
        "replicas": swarm.is_replica.astype(int).tolist(),
        "poses": base64.b64encode(steps.tobytes()).decode("ascii"),
    }
