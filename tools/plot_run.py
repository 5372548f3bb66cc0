#!/usr/bin/python3
"""Plots a run and writes a report: reads DIR/log.csv, summary.json and timing.json, writes PNGs and report.html."""
import pathlib
import re
import sys

from plotting import figures, report
from plotting.command_line import Parser
from plotting.run_log import RunLog


def main():
    parser = Parser(description=__doc__)
    parser.add_argument("directory", metavar="DIR", type=pathlib.Path, help="folder of log.csv")
    parser.add_argument("--title", help="title of the report (default: the experiment's name)")
    parser.add_argument("--tracking-from", metavar="S", type=float, default=1.0,
                        help="errors count from S seconds after control became ACTIVE (default: %(default)s)")
    parser.add_argument("--quiet", action="store_true", help="do not print the tables")
    arguments = parser.parse_args()

    try:
        log = RunLog(arguments.directory)
    except (OSError, ValueError) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    drawn = [figure for figure in (draw(log, arguments.directory) for draw in figures.ALL) if figure]
    name = re.search(r"\bname (.+)$", log.origin)
    title = arguments.title or (f"Run of {name.group(1)}" if name else "Run of a soft arm")
    path = report.write(log, drawn, arguments.tracking_from, title)
    if not arguments.quiet:
        print(report.as_text(log, arguments.tracking_from) + "\n")
    print(f"report: {path}")
    return 0


sys.exit(main())
