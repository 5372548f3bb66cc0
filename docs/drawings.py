#!/usr/bin/python3
"""Draws data_flow.svg and conventions.svg in docs/explanation; --check only reports whether they are up to date."""
import math
import pathlib
import sys

INK, SOFT, LINE, BLUE, RED, GREEN = "#1b2733", "#5b6770", "#8795a1", "#0b6fb8", "#d1571b", "#12876f"
STYLE = f"""<style>
text {{ font-family: system-ui, 'DejaVu Sans', sans-serif; font-size: 13px; fill: {INK}; }}
.head {{ font-size: 15px; font-weight: 600; }} .small {{ font-size: 11px; fill: {SOFT}; }}
.channel {{ font-family: ui-monospace, 'DejaVu Sans Mono', monospace; font-size: 11px; fill: {BLUE}; }}
.symbol {{ font-family: 'DejaVu Serif', Georgia, serif; font-style: italic; font-size: 15px; }}
.mid {{ text-anchor: middle; }} .end {{ text-anchor: end; }}
</style>
<defs>
"""
MARKER = """<marker id="{id}" viewBox="0 0 10 10" refX="8.5" refY="5" markerWidth="7" markerHeight="7" orient="auto-start-reverse">\
<path d="M0 1L9 5L0 9z" fill="{colour}"/></marker>
"""
COLOURS = {"ink": INK, "soft": LINE, "blue": BLUE, "red": RED, "green": GREEN}


class Drawing:
    """On a light background, so that the drawing reads the same on white and on dark pages."""

    def __init__(self, width, height, title):
        self.parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img">\n',
                      f"<title>{title}</title>\n", STYLE,
                      *(MARKER.format(id=name, colour=colour) for name, colour in COLOURS.items()), "</defs>\n",
                      f'<rect width="{width}" height="{height}" rx="10" fill="#ffffff"/>\n']

    def add(self, text):
        self.parts.append(text + "\n")

    def text(self, x, y, text, kind=""):
        self.add(f'<text x="{x:.1f}" y="{y:.1f}"' + (f' class="{kind}"' if kind else "") + f">{text}</text>")

    def box(self, x, y, width, height, fill="#eaf2f9", stroke=BLUE, dash=""):
        dash = f' stroke-dasharray="{dash}"' if dash else ""
        self.add(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="7" fill="{fill}" stroke="{stroke}"{dash}/>')

    def path(self, points, colour="ink", width=1.5, arrow=True, dash="", both=False):
        d = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        extra = f' marker-end="url(#{colour})"' if arrow else ""
        extra += f' marker-start="url(#{colour})"' if both else ""
        extra += f' stroke-dasharray="{dash}"' if dash else ""
        self.add(f'<path d="{d}" fill="none" stroke="{COLOURS[colour]}" stroke-width="{width}" stroke-linejoin="round"{extra}/>')

    def __str__(self):
        return "".join(self.parts) + "</svg>\n"


def data_flow():
    d = Drawing(1260, 420, "From a motion-capture frame to valve pressures")
    d.box(18, 24, 206, 310, "#f4f6f8", LINE)
    d.text(121, 49, "softarm-plant", "head mid")
    d.text(121, 67, "or the real arm", "small mid")
    d.box(34, 92, 174, 62, "#fdf0e9", RED)
    d.text(121, 118, "motion capture", "mid")
    d.text(121, 138, "poses of all bodies", "small mid")
    d.path([(121, 213), (121, 158)], "soft")
    d.text(130, 190, "u", "symbol")
    d.box(34, 216, 174, 102, "#fdf0e9", RED)
    d.text(121, 241, "valves and arm", "mid")
    d.text(121, 261, "vent by themselves when", "small mid")
    d.text(121, 277, "no fresh command comes", "small mid")
    d.text(121, 302, "equation of motion (16)", "small mid")

    d.box(352, 24, 890, 246, "#f4f6f8", LINE)
    d.text(368, 49, "softarmd", "head")
    d.text(450, 49, "one tick, 50 Hz to 1 kHz and above", "small")
    stages = [("validate", "order, age, jumps,", "quaternions, lengths", "estimation/"),
              ("estimate", "u by (19), (20)", "filter: u, u′ now", "estimation/"),
              ("safety", "active, hold, vent,", "fault, with reason", "runtime/"),
              ("control (17)", "feed-forward of the", "reference, K_P, K_D", "control/, model/"),
              ("allocate", "τ_A to pressures", "of all chambers", "actuation/"),
              ("limit", "0 to p_max, slew,", "ramp when venting", "actuation/")]
    width, gap, top = 130, 16, 92
    for i, (name, first, second, module) in enumerate(stages):
        x = 366 + i * (width + gap)
        d.box(x, top, width, 78)
        middle = x + width / 2
        d.text(middle, top + 25, name, "head mid")
        d.text(middle, top + 47, first, "small mid")
        d.text(middle, top + 63, second, "small mid")
        d.text(middle, top - 8, module, "small mid")
        if i:
            d.path([(x - gap + 1, top + 39), (x - 1, top + 39)])
    control = 366 + 3 * (width + gap) + width / 2
    d.box(control - 96, 206, 192, 48, "#e9f5f1", GREEN)
    d.text(control, 226, "reference", "mid")
    d.text(control, 244, "set point, (24), way points", "small mid")
    d.path([(control, 205), (control, 173)], "green")

    d.path([(209, 123), (363, 123)], "blue", 2)
    d.text(286, 114, "SOFTARM_MOCAP", "channel mid")
    d.path([(209, 240), (349, 240)], "blue", 1.5)
    d.text(284, 231, "SOFTARM_PRESSURE", "channel mid")
    last = 366 + 5 * (width + gap) + width / 2
    d.path([(last, 171), (last, 302), (211, 302)], "blue", 2)
    d.text(750, 294, "SOFTARM_PRESSURE_COMMAND", "channel mid")

    d.box(352, 346, 320, 58, "#f4f6f8", LINE)
    d.text(512, 370, "operator, planner", "mid")
    d.text(512, 390, "SOFTARM_OPERATOR  SOFTARM_REFERENCE", "channel mid")
    d.path([(512, 345), (512, 273)], "blue", 1.5)
    d.box(922, 346, 320, 58, "#f4f6f8", LINE)
    d.text(1082, 370, "softarm watch, lcm-logger, lcm-spy", "mid")
    d.text(1082, 390, "SOFTARM_STATUS  SOFTARM_TIMING", "channel mid")
    d.path([(1000, 271), (1000, 343)], "blue", 1.5)
    d.text(121, 372, "blue: LCM over UDP multicast", "channel mid")
    d.text(121, 390, "channel names are configuration", "small mid")
    return str(d)


def arc(x, y, angle, length, theta, points=40):
    """Points and tangent angles (from straight down, towards +x) along a segment drawn in its bending plane."""
    result = []
    for k in range(points + 1):
        s = k / points
        a = angle + theta * s
        # The chord of an arc with turning angle theta s, exact also for theta = 0.
        half = theta * s / 2
        chord = length * s * (math.sin(half) / half if half else 1.0)
        result.append((x + chord * math.sin(angle + half), y + chord * math.cos(angle + half), a))
    return result


def axes_of_frame(d, x, y, angle, name, size=46, label=(0, 0)):
    """x (red) and z (blue) of a frame whose z points `angle` from straight down towards +x; y points out of the page."""
    z = (x + size * math.sin(angle), y + size * math.cos(angle))
    ex = (x + size * math.cos(angle), y - size * math.sin(angle))
    d.path([(x, y), ex], "red", 2)
    d.path([(x, y), z], "blue", 2)
    d.add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="#ffffff" stroke="{GREEN}" stroke-width="1.6"/>'
          f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.7" fill="{GREEN}"/>')
    d.text(x + label[0], y + label[1], name, "symbol")
    return ex, z


def body(d, points, width, colour="#cfe1f0"):
    trace = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y, _ in points)
    d.add(f'<path d="{trace}" fill="none" stroke="{colour}" stroke-width="{width}"/>')
    d.add(f'<path d="{trace}" fill="none" stroke="{INK}" stroke-width="1.2" stroke-dasharray="7 3 2 3"/>')


def sub(symbol, index):
    return f'{symbol}<tspan dy="4" font-size="11">{index}</tspan><tspan dy="-4">&#8203;</tspan>'


def hanging_arm(d):
    d.text(24, 34, "A hanging arm", "head")
    d.text(24, 52, "the straight arm points along +z of S₀; R₀ = diag(1, −1, −1)", "small")
    x, y, angle = 172, 96, 0.0
    d.add(f'<rect x="{x - 62}" y="{y - 14}" width="124" height="14" rx="2" fill="#d5dce2"/>')
    frames = [(x, y, angle)]
    segments = []
    for theta in (0.55, 0.45, -1.05):
        points = arc(x, y, angle, 96, theta)
        segments.append(points)
        x, y, angle = points[-1]
        frames.append((x, y, angle))
    for points, shade in zip(segments, ("#cfe1f0", "#bcd6ea", "#cfe1f0")):
        body(d, points, 30, shade)
    labels = [(-32, 18), (-44, 8), (-34, 22), (-34, 4)]
    for i, ((fx, fy, fa), label) in enumerate(zip(frames, labels)):
        ex, ez = axes_of_frame(d, fx, fy, fa, sub("S", i), 40 if i else 46, label)
        if i == 0:
            d.text(ex[0] + 5, ex[1] + 5, sub("x", 0), "symbol")
            d.text(ez[0] - 36, ez[1] + 2, sub("z", 0), "symbol")
    for i, (points, offset) in enumerate(zip(segments, ((26, 2), (22, -8), (26, 0)))):
        px, py, _ = points[20]
        d.text(px + offset[0], py + offset[1], sub("L", i + 1), "symbol")
    d.text(132, 330, "here φ₁ = φ₂ = 0", "small")
    d.text(132, 346, "and φ₃ = π", "small")
    # World frame: z up, so y points into the page.
    wx, wy = 52, 330
    d.path([(wx, wy), (wx + 42, wy)], "red", 2)
    d.path([(wx, wy), (wx, wy - 42)], "blue", 2)
    d.add(f'<circle cx="{wx}" cy="{wy}" r="5" fill="#ffffff" stroke="{GREEN}" stroke-width="1.6"/>'
          f'<path d="M{wx - 3} {wy - 3}l6 6m0 -6l-6 6" stroke="{GREEN}" stroke-width="1.4"/>')
    d.text(wx + 46, wy + 5, "x", "symbol")
    d.text(wx + 5, wy - 44, "z", "symbol")
    d.text(wx - 20, wy + 22, "world W", "small")
    d.path([(24, 130), (24, 176)], "ink", 1.5)
    d.text(32, 158, "g", "symbol")


def one_segment(d):
    d.text(424, 34, "One segment, in its bending plane", "head")
    d.text(424, 52, "constant curvature; θ > 0 bends towards (cos φ, sin φ)", "small")
    x, y, length, theta = 486, 100, 226, 1.15
    points = arc(x, y, 0.0, length, theta)
    radius = length / theta
    centre = (x + radius, y)
    end = points[-1]
    d.path([(x, y), centre], "soft", 1, arrow=False, dash="4 3")
    d.path([end[:2], centre], "soft", 1, arrow=False, dash="4 3")
    body(d, points, 36)
    # theta at the centre of the circle: between the two radii.
    r = 50
    wedge = [(centre[0] - r * math.cos(theta * k / 20), centre[1] + r * math.sin(theta * k / 20)) for k in range(21)]
    d.path(wedge, "ink", 1.4)
    d.text(centre[0] - r * math.cos(theta / 2) - 20, centre[1] + r * math.sin(theta / 2) + 6, "θ", "symbol")
    d.text((x + centre[0]) / 2 + 20, y - 8, "L / θ", "symbol")
    # theta again: between the extended z of the lower frame and z of the upper frame.
    d.path([end[:2], (end[0], end[1] + 60)], "soft", 1, arrow=False, dash="4 3")
    turn = [(end[0] + 40 * math.sin(theta * k / 20), end[1] + 40 * math.cos(theta * k / 20)) for k in range(21)]
    d.path(turn, "ink", 1.4)
    d.text(end[0] + 46 * math.sin(theta / 2) - 2, end[1] + 46 * math.cos(theta / 2) + 11, "θ", "symbol")
    d.path([(x, y), end[:2]], "green", 1.5)
    chord = points[20]
    d.text((x + end[0]) / 2 + 16, (y + end[1]) / 2 + 4, "t", "symbol")
    d.text(chord[0] - 42, chord[1] + 14, "L", "symbol")
    ex, ez = axes_of_frame(d, x, y, 0.0, "S<tspan dy='4' font-size='11'>i−1</tspan>", 52, (-50, 2))
    d.text(ex[0] - 8, ex[1] + 20, "(cos φ, sin φ)", "small")
    d.text(ez[0] - 34, ez[1] - 2, "z<tspan dy='4' font-size='11'>i−1</tspan>", "symbol")
    ex, ez = axes_of_frame(d, *end, "S<tspan dy='4' font-size='11'>i</tspan>", 52, (-28, 22))
    d.text(ez[0] + 6, ez[1] + 6, "z<tspan dy='4' font-size='11'>i</tspan>", "symbol")
    d.text(424, 372, "t = L (c₂ u, c₁), R = I + c₁ [w]× + c₂ [w]×², w = (−u₂, u₁, 0)", "small")


def cross_section(d):
    d.text(824, 34, "Across a segment, z towards the viewer", "head")
    d.text(824, 52, "u = θ (cos φ, sin φ): smooth where the arm is straight", "small")
    cx, cy, r, phi = 968, 206, 92, math.radians(38)
    d.add(f'<circle cx="{cx}" cy="{cy}" r="{r}" fill="#eaf2f9" stroke="{LINE}"/>')
    for j, degrees in enumerate((0, 90, 180, 270)):
        chi = math.radians(degrees)
        x, y = cx + 64 * math.cos(chi), cy - 64 * math.sin(chi)
        d.add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="20" fill="#fdf0e9" stroke="{RED}"/>')
        dx, dy = ((4, 14), (9, 5), (0, 5), (0, 5))[j]
        d.text(x + dx, y + dy, f"p<tspan dy='4' font-size='11'>{j + 1}</tspan>", "symbol mid")
    d.path([(cx, cy), (cx + r + 42, cy)], "ink", 1.3)
    d.path([(cx, cy), (cx, cy - r - 34)], "ink", 1.3)
    d.text(cx + r + 46, cy + 5, "x<tspan dy='4' font-size='11'>i−1</tspan>", "symbol")
    d.text(cx + 8, cy - r - 26, "y<tspan dy='4' font-size='11'>i−1</tspan>", "symbol")
    tip = (cx + 118 * math.cos(phi), cy - 118 * math.sin(phi))
    d.path([(cx, cy), tip], "blue", 2.6)
    d.text(tip[0] + 6, tip[1] - 2, "u", "symbol")
    turn = [(cx + 34 * math.cos(phi * k / 16), cy - 34 * math.sin(phi * k / 16)) for k in range(17)]
    d.path(turn, "ink", 1.4)
    d.text(cx + 20 * math.cos(phi / 2) - 3, cy - 20 * math.sin(phi / 2) + 4, "φ", "symbol")
    d.text(824, 334, "chambers at χ = 0, 90, 180, 270 degrees (any number ≥ 3, any angle).", "small")
    d.text(824, 350, "Pressure p in the chamber at χ pushes away from its own side:", "small")
    d.text(824, 372, "generalized force in u: −g p (cos χ, sin χ), g in N m / bar", "small")


def conventions():
    d = Drawing(1240, 394, "Frames, phi, theta, u and chambers")
    hanging_arm(d)
    d.path([(404, 24), (404, 376)], "soft", 0.7, arrow=False)
    one_segment(d)
    d.path([(804, 24), (804, 376)], "soft", 0.7, arrow=False)
    cross_section(d)
    return str(d)


def main():
    folder = pathlib.Path(__file__).resolve().parent / "explanation"
    stale = []
    for name, draw in (("data_flow.svg", data_flow), ("conventions.svg", conventions)):
        path = folder / name
        if "--check" in sys.argv[1:]:
            if not path.exists() or path.read_text(encoding="utf-8") != draw():
                stale.append(f"docs/explanation/{name} is not what docs/drawings.py draws: run it without --check")
        else:
            path.write_text(draw(), encoding="utf-8")
    print("\n".join(stale) or "drawings are up to date")
    return 1 if stale else 0


sys.exit(main())
