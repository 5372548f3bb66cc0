"""The arm in 3D as a part of report.html: the run plays in any browser, without a server or a network."""
import base64
import json
import pathlib

import numpy as np

FRAMES = 450
LONGEST_STEP_S = 1 / 15  # between frames the page interpolates
POINTS_PER_SEGMENT = 8
SCALE_M = 1e-4  # of the stored points: 0.1 mm


def arcs(u, length_m):
    """Points of the arm in S_0, (rows, n POINTS_PER_SEGMENT + 1, 3) in m, of u (rows, n, 2) and n lengths.

    x l (x c2 u, c1) at the arc fraction x, with the cosine and sine in forms that hold down to theta = 0.
    """
    rows, segments = u.shape[:2]
    points = np.zeros((rows, segments * POINTS_PER_SEGMENT + 1, 3))
    rotation, end = np.broadcast_to(np.eye(3), (rows, 3, 3)), np.zeros((rows, 3))
    theta = np.hypot(u[..., 0], u[..., 1])

    def c1_c2(angle):
        return np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2

    for i in range(segments):
        for k in range(1, POINTS_PER_SEGMENT + 1):
            x = k / POINTS_PER_SEGMENT
            c1, c2 = c1_c2(x * theta[:, i])
            local = x * length_m[i] * np.column_stack([x * c2[:, None] * u[:, i], c1])
            points[:, i * POINTS_PER_SEGMENT + k] = end + np.einsum("rij,rj->ri", rotation, local)
        end = points[:, (i + 1) * POINTS_PER_SEGMENT]
        # I + c1 [w]x + c2 [w]x^2, w = (-u_y, u_x, 0)
        c1, c2 = c1_c2(theta[:, i])
        cross = np.zeros((rows, 3, 3))
        cross[:, 0, 2], cross[:, 1, 2] = u[:, i, 0], u[:, i, 1]
        cross[:, 2, 0], cross[:, 2, 1] = -u[:, i, 0], -u[:, i, 1]
        rotation = rotation @ (np.eye(3) + c1[:, None, None] * cross + c2[:, None, None] * cross @ cross)
    return points


def _packed(points):
    """Little-endian int16 in units of SCALE_M; the lowest number where a point is unknown."""
    units = np.where(np.isfinite(points), np.clip(np.round(points / SCALE_M), -32767, 32767), -32768)
    return base64.b64encode(units.astype("<i2").tobytes()).decode()


def _numbers(values, digits):
    return [None if not np.isfinite(v) else round(float(v), digits) for v in values]


def scene(log):
    """What the page plays, as a dict for JSON; None where the run does not say where the arm is."""
    arm = log.summary.get("arm")
    if arm is None or log.u is None or len(log.t_s) < 2:
        return None
    duration = log.t_s[-1] - log.t_s[0]
    count = int(np.clip(np.ceil(duration / LONGEST_STEP_S) + 1, 2, min(FRAMES, len(log.t_s))))
    rows = np.unique(np.searchsorted(log.t_s, np.linspace(log.t_s[0], log.t_s[-1], count)).clip(0, len(log.t_s) - 1))
    rotation, position = np.array(arm["base_rotation"]), np.array(arm["base_position_m"])
    lines = []
    for name, u in (("reference", log.reference), ("true arm", log.true_u), ("estimate", log.u)):
        if u is not None:
            lines.append({"name": name, "points": _packed(arcs(u[rows], arm["length_m"]) @ rotation.T + position)})
    error = None
    if log.tip_m is not None and log.tip_reference_m is not None:
        error = _numbers(1e3 * np.linalg.norm(log.tip_m - log.tip_reference_m, axis=1)[rows], 3)
    pressures = [log.pressures("pm", i) if log.pressures("pm", i) is not None else log.pressures("p", i)
                 for i in range(1, log.segments + 1)]
    chambers = [p[rows] for p in pressures if p is not None]
    return {
        "t": _numbers(log.t_s[rows], 3),
        "mode": [f"{mode} ({reason})" if reason not in ("", "none") else mode
                 for mode, reason in zip(log.mode[rows], log.reason[rows])],
        "lines": lines,
        "perLine": log.segments * POINTS_PER_SEGMENT + 1,
        "perSegment": POINTS_PER_SEGMENT,
        "scale": SCALE_M,
        "tipError": error,
        "pressures": [[_numbers(row, 2) for row in chamber] for chamber in chambers],
        "unit": "N m" if log.torques else "bar",
    }


def section(log):
    """HTML of the player, or nothing."""
    data = scene(log)
    if data is None:
        return ""
    script = pathlib.Path(__file__).with_name("player.js").read_text(encoding="utf-8")
    numbers = json.dumps(data, separators=(",", ":")).replace("</", "<\\/")
    return f"""<h2>The arm</h2>
<figure id="player"><canvas id="arm" width="1060" height="520"></canvas>
<div class="controls"><button id="play">pause</button> <input id="time" type="range" min="0" max="1" step="0.0005" value="0">
<select id="speed"><option value="0.25">¼</option><option value="1" selected>1</option><option value="4">4</option></select></div>
<canvas id="error" width="1060" height="130"></canvas>
<figcaption>Drag to turn, wheel to zoom. Below: distance of the tip from its reference over time.</figcaption></figure>
<script id="run" type="application/json">{numbers}</script>
<script>{script}</script>
"""
