"""Pages: one file each, nothing loaded from outside, everything that comes from the user escaped."""

import base64
import hashlib
import json
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from turing_learning._files import whole
from turing_learning.analysis import is_known
from turing_learning.figures import Picture

from ._listing import NOTHING, listing_markup, number_markup, section
from ._numbers import shown
from ._replay import Replay, Swarm
from ._run import ACTIVE, ParameterRow, RunReport, RunTable, describe_selection

GENERATOR = "Turing Learning for Python"
"""By which a page is known."""
HEAD = 2048  # bytes of a page, within which it says so
STEPS = 65535  # of a pose's coordinate, over the view or one turn


def report_page(report: RunReport) -> str:
    """Return a run as one HTML page that works offline.

    Parameters
    ----------
    report
        What to show.

    Returns
    -------
    str
        The page; its Content-Security-Policy forbids it to load anything.
    """
    sections = [
        _table(report.table),
        _health(report),
        _check(report),
        _replay(report.replay) if report.replay is not None else "",
        _figures(report.figures),
        _configuration(report.configuration),
        _manifest(report),
    ]
    return _page(report.title, report.verdict, sections, report.replay)


def replay_page(replay: Replay, title: str | None = None) -> str:
    """Return an HTML page with nothing but a replay; it works offline.

    Parameters
    ----------
    replay
        What to show.
    title
        Title of the page; the replay's own by default.

    Returns
    -------
    str
    """
    return _page(title or replay.title, "", [_replay(replay, heading=bool(title) and title != replay.title)], replay)


def write_page(page: str, path: str | Path) -> Path:
    """Write a page to a file, which appears whole or not at all.

    Parameters
    ----------
    page
        The page.
    path
        The file, in an existing folder; one that exists is replaced.

    Returns
    -------
    Path

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


def _page(title: str, verdict: str, sections: list[str], replay: Replay | None) -> str:
    script = _asset("_replay.js") if replay is not None else ""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return Template(_asset("_page.html")).substitute(
        generator=GENERATOR,
        policy=f"'sha256-{digest}'",
        title=escape(title),
        style=_asset("_style.css"),
        verdict=f'<p class="verdict">{escape(verdict)}</p>' if verdict else "",
        sections="\n".join(section for section in sections if section),
        data=_embed(replay) if replay is not None else "null",
        script=script,
    )


def _table(table: RunTable) -> str:
    has_truth = any(row.truth is not None for row in table.rows)
    has_published = any(row.published_error is not None for row in table.rows)
    header = '<th scope="col">Parameter</th><th scope="col">Inferred</th>'
    has_interval = any(row.interval is not None for row in table.rows)
    if has_interval:
        header += '<th scope="col">90 % interval</th>'
    if has_truth:
        header += '<th scope="col">True</th><th scope="col">Absolute error</th>'
    if has_published:
        header += '<th scope="col">Paper&rsquo;s error</th>'
    header += '<th scope="col" class="apart">Best model</th>'
    if has_truth:
        header += '<th scope="col">Absolute error</th>'
    body = "\n".join(_row(row, has_interval, has_truth, has_published) for row in table.rows)
    mean = _mean(table, has_interval, has_published) if has_truth and table.estimate_mae is not None else ""
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return section(
        "result",
        "Inferred parameters",
        f'<div class="scroll" tabindex="0" role="region" aria-labelledby="result-heading"><table class="numbers">'
        f"<thead><tr>{header}</tr></thead>\n<tbody>{body}</tbody>\n{mean}</table></div>{note}",
    )


def _row(row: ParameterRow, has_interval: bool, has_truth: bool, has_published: bool) -> str:
    cells = f'<th scope="row">{escape(row.name)}</th><td class="strong">{number_markup(row.estimate)}</td>'
    if has_interval:
        cells += f"<td>{_ends(row.interval)}</td>"
    if has_truth:
        cells += f"<td>{number_markup(row.truth)}</td><td>{number_markup(row.estimate_error)}</td>"
    if has_published:
        cells += f"<td>{shown(row.published_error, '{:g}'.format, NOTHING)}</td>"
    cells += f'<td class="apart">{number_markup(row.best_model)}</td>'
    if has_truth:
        cells += f"<td>{number_markup(row.best_model_error)}</td>"
    return f"<tr>{cells}</tr>"


def _ends(interval: tuple[float, float] | None) -> str:
    return NOTHING if interval is None or not is_known(*interval) else " to ".join(map(number_markup, interval))


def _mean(table: RunTable, has_interval: bool, has_published: bool) -> str:
    before = "<td></td>" * (2 + has_interval)
    gap = "<td></td>" if has_published else ""
    return (
        f'<tfoot><tr><th scope="row">Mean</th>{before}<td>{number_markup(table.estimate_mae)}</td>{gap}'
        f'<td class="apart"></td><td>{number_markup(table.best_model_mae)}</td></tr></tfoot>'
    )


def _health(report: RunReport) -> str:
    if not report.selection:
        return ""
    healthy = all(state == ACTIVE for state in report.selection)
    text = escape(describe_selection(report.selection))
    if not healthy:
        text += (
            " In those generations all models were equally fit and drifted by chance; many of them near the end make"
            " the result doubtful."
        )
    return f'<p class="health {"good" if healthy else "warning"}" role="note">{text}</p>'


def _check(report: RunReport) -> str:
    if report.check is None:
        return ""
    pictures = "".join(_figure(figure) for figure in report.check_figures)
    return f'{listing_markup(report.check)}<div class="figures">{pictures}</div>'


def _figures(figures: tuple[Picture, ...]) -> str:
    if not figures:
        return ""
    return section("figures", "Figures", f'<div class="figures">{"".join(_figure(figure) for figure in figures)}</div>')


def _figure(figure: Picture) -> str:
    caption = f" {escape(figure.caption)}" if figure.caption else ""
    return (
        f'<figure class="plot{" wide" if figure.wide else ""}"><figcaption><b>{escape(figure.title)}</b>{caption}'
        f'</figcaption><div class="scroll" tabindex="0" role="region" aria-label="{escape(figure.title)}">'
        f"{figure.svg}</div></figure>\n"
    )


def _configuration(text: str) -> str:
    if not text:
        return ""
    return (
        f'<details id="configuration"><summary>Configuration</summary><pre><code>{escape(text)}</code></pre></details>'
    )


def _manifest(report: RunReport) -> str:
    if not report.manifest:
        return ""
    rows = "\n".join(
        f'<tr><th scope="row">{escape(str(name))}</th><td>{escape(str(value))}</td></tr>'
        for name, value in report.manifest
    )
    return (
        '<details id="manifest"><summary>Manifest</summary><div class="scroll" tabindex="0" role="region" '
        f'aria-label="Manifest"><table class="facts"><tbody>{rows}</tbody></table></div></details>'
    )


def _replay(replay: Replay, heading: bool = True) -> str:
    stages = "".join(_stage(swarm) for swarm in replay.swarms)
    body = Template(_asset("_replay.html")).substitute(
        stages=stages, count=len(replay.swarms), duration=f"{replay.duration_s:.1f}"
    )
    if heading:
        return section("replay", escape(replay.title), body)
    return f'<section id="replay" aria-label="Replay">{body}</section>'


def _stage(swarm: Swarm) -> str:
    replicas = int(swarm.is_replica.sum())
    counts = [
        _legend("agent", swarm.robots - replicas, "agent"),
        _legend("replica", replicas, "replica"),
        _legend("object", swarm.objects, "object"),
    ]
    return (
        f'<figure class="stage"><figcaption><b>{escape(swarm.label)}</b>{"".join(counts)}</figcaption>'
        f'<canvas role="img" aria-label="{escape(swarm.label)}, seen from above"></canvas></figure>\n'
    )


def _legend(kind: str, count: int, word: str) -> str:
    return f'<span class="key {kind}">{count} {word}{"s" if count != 1 else ""}</span>' if count else ""


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
