"""report.html: the numbers of a run in tables and its figures, in one self-contained file."""
import base64
import html

import numpy as np

from . import player, style

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; color: #1b2733; background: #f4f6f8; margin: 0; }}
main {{ max-width: 1100px; margin: 0 auto; padding: 1.5rem 1rem 4rem; }}
h1 {{ font-size: 1.6rem; margin: 0 0 .2rem; }} h2 {{ font-size: 1.1rem; margin: 2rem 0 .5rem; }}
.origin {{ color: #5b6770; font-size: .85rem; overflow-wrap: anywhere; }}
.tables {{ display: flex; flex-wrap: wrap; gap: 1rem; }}
table {{ border-collapse: collapse; background: white; border-radius: 6px; overflow: hidden;
  box-shadow: 0 1px 2px #0002; font-variant-numeric: tabular-nums; }}
th, td {{ padding: .35rem .8rem; text-align: right; border-bottom: 1px solid #e8ecf0; }}
th:first-child, td:first-child {{ text-align: left; }} th {{ background: #eaeff4; font-weight: 600; font-size: .85rem; }}
tr:last-child td {{ border-bottom: 0; }}
figure {{ margin: 0 0 1.2rem; background: white; border-radius: 6px; padding: .6rem; box-shadow: 0 1px 2px #0002; }}
img {{ width: 100%; height: auto; display: block; }}
.why {{ background: #fdf0d5; border-left: 4px solid #e07b39; padding: .5rem .8rem; }}
#player canvas {{ width: 100%; display: block; touch-action: none; }}
.controls {{ display: flex; gap: .6rem; }} .controls input {{ flex: 1; }}
figcaption {{ color: #5b6770; font-size: .85rem; padding: .3rem .4rem 0; }}
</style></head><body><main>
<h1>{title}</h1><p class="origin">{origin}</p>
{why}{player}<div class="tables">{tables}</div>
<h2>Figures</h2>
{figures}
</main></body></html>
"""


def _fixed(value, digits):
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def tracking_table(log, from_s):
    """Head and rows of the tracking errors per segment, or None without a reference."""
    tracking = log.tracking(from_s)
    if tracking is None:
        return None
    # The run itself computed summary.json; the log has the same numbers, and u by segment.
    known = log.summary.get("tracking", {})
    rows = []
    for i, (u_rms, u_max, theta_rms, phi_rms) in enumerate(tracking):
        known_theta, known_phi = known.get("theta_rms_rad", []), known.get("phi_rms_rad", [])
        theta = known_theta[i] if i < len(known_theta) and known_theta[i] is not None else theta_rms
        phi = known_phi[i] if i < len(known_phi) and known_phi[i] is not None else phi_rms
        rows.append([f"segment {i + 1}"] + [_fixed(1e3 * v, 2) for v in (theta, phi, u_rms, u_max)])
    u_rms, u_max = known.get("u_rms_rad"), known.get("u_max_rad")  # null where the truth is not known: a recording
    u_rms = np.sqrt(np.nanmean(tracking[:, 0] ** 2)) if u_rms is None else u_rms
    u_max = np.nanmax(tracking[:, 1]) if u_max is None else u_max
    rows.append(["all", "", "", _fixed(1e3 * u_rms, 2), _fixed(1e3 * u_max, 2)])
    if known.get("tip_rms_m") is not None:
        largest = known.get("tip_max_m")
        rows.append(["tip [mm]", "", "", _fixed(1e3 * known["tip_rms_m"], 2),
                     "" if largest is None else _fixed(1e3 * largest, 2)])
    if known.get("tip_near_after_s") is not None:
        rows.append(["tip within 10 mm after [s]", "", "", _fixed(known["tip_near_after_s"], 2), ""])
    return ["tracking error [mrad]", "θ rms", "φ rms", "u rms", "u max"], rows


def pressure_table(log):
    """Head and rows of the largest and mean pressures per segment, or None without pressures."""
    rows = []
    for segment in range(1, log.segments + 1):
        commanded, real = log.pressures("p", segment), log.pressures("pm", segment)
        if commanded is None and real is None:
            continue
        numbers = [np.nanmax(v) if v is not None else None for v in (commanded, real)]
        numbers.append(np.nanmean(commanded if commanded is not None else real))
        rows.append([f"segment {segment}"] + [_fixed(v, 3) for v in numbers])
    quantity = "moment [N m]" if log.torques else "pressure [bar]"
    return ([quantity, "commanded, max", "behind the valve, max", "mean"], rows) if rows else None


def timing_table(log):
    """Head and rows of the tick's timing, or None without any."""
    rows = []
    for name, text in (("tick_us", "tick"), ("lateness_us", "wake-up after the deadline"),
                       ("frame_age_us", "age of the newest frame"), ("publish_us", "publishing")):
        known = log.timing.get(name, {})
        if any(key in known for key in ("p50", "p99", "max")):
            rows.append([text] + [_fixed(known.get(key), 1) for key in ("p50", "p99", "max")])
    if log.timing.get("real_time_factor"):
        rows.append(["times faster than real time", "", "", _fixed(log.timing["real_time_factor"], 1)])
    return (["timing [µs]", "p50", "p99", "max"], rows) if rows else None


def _flat(prefix, value):
    if isinstance(value, dict):
        for key, inner in value.items():
            if not prefix and key == "arm":
                continue  # the configuration's, for the player
            yield from _flat(f"{prefix}{key}.", inner)
    elif isinstance(value, list):
        yield prefix.rstrip("."), ", ".join("–" if v is None else f"{v:.4g}" if isinstance(v, float) else str(v) for v in value)
    elif value is not None:
        yield prefix.rstrip("."), f"{value:.4g}" if isinstance(value, float) else str(value)


def summary_table(log):
    """All of summary.json, key by key."""
    rows = [[key, value] for key, value in _flat("", log.summary)]
    return (["summary", ""], rows) if rows else None


def mode_table(log, longest=12):
    """Head and rows of the periods of each mode, in order."""
    spans = log.mode_spans()
    rows = [[mode or "–", reason, _fixed(start, 3), _fixed(end - start, 3)] for mode, reason, start, end in spans[:longest]]
    if len(spans) > longest:
        rows.append([f"and {len(spans) - longest} more", "", "", ""])
    return ["mode", "reason", "from [s]", "for [s]"], rows


def why_not_active(log, longest=5):
    """Sentences on the time that the arm was not ACTIVE after it might have been; nothing where there was none."""
    spans = [span for span in log.mode_spans() if span[0]]
    if not spans:
        return []
    def period(mode, reason, start, end):
        because = "" if reason in ("", "none") else f": {reason.replace('_', ' ')}"
        return f"{mode}{because}, from {start:.2f} s for {end - start:.2f} s"
    active = [mode == "ACTIVE" for mode, *_ in spans]
    if not any(active):
        sentences = ["The arm never became ACTIVE."]
        missed = spans
    else:
        missed = [span for span, was in zip(spans, active) if not was][1 if not active[0] else 0:]
        if not missed:
            return []
        sentences = [f"The arm was not ACTIVE for {sum(end - start for _, _, start, end in missed):.2f} s after its start."]
    sentences += [period(*span) for span in missed[:longest]]
    if len(missed) > longest:
        sentences.append(f"and {len(missed) - longest} more periods (table of modes)")
    return sentences


def tables(log, from_s):
    candidates = (tracking_table(log, from_s), pressure_table(log), timing_table(log), mode_table(log), summary_table(log))
    return [table for table in candidates if table is not None]


def _plain(table):
    head, rows = table
    widths = [max(len(str(line[i])) for line in [head, *rows]) for i in range(len(head))]
    return "\n".join("  ".join([str(line[0]).ljust(widths[0])] + [str(cell).rjust(width) for cell, width in
                                                                  zip(line[1:], widths[1:])]).rstrip()
                     for line in [head, *rows])


def as_text(log, from_s):
    """Tracking, pressures and timing for a terminal: first column left, the others right."""
    chosen = tracking_table(log, from_s), pressure_table(log), timing_table(log)
    return "\n\n".join(_plain(table) for table in chosen if table)


def _as_html(table):
    head, rows = table
    def cells(tag, line):
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>" for cell in line) + "</tr>"
    return "<table>" + cells("th", head) + "".join(cells("td", row) for row in rows) + "</table>"


def write(log, figures, from_s, title):
    """report.html with every table and figure inside; returns its path."""
    pictures = []
    for name, caption in figures:
        data = base64.b64encode((log.directory / name).read_bytes()).decode()
        pictures.append(f'<figure><img alt="{html.escape(caption)}" src="data:image/png;base64,{data}">'
                        f"<figcaption>{html.escape(caption)}</figcaption></figure>")
    path = log.directory / "report.html"
    reasons = "<br>".join(map(html.escape, why_not_active(log)))
    why = f'<p class="why">{reasons}</p>\n' if reasons else ""
    page = PAGE.format(title=html.escape(title), origin=html.escape(log.origin), why=why, player=player.section(log),
                       tables="".join(map(_as_html, tables(log, from_s))), figures="\n".join(pictures))
    style.replace(path, lambda partial: partial.write_text(page, encoding="utf-8"))
    return path
