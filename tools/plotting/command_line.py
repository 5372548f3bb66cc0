"""Command lines of our Python scripts: a wrong one ends with exit code 64, as that of every program does."""
import argparse
import pathlib
import sys


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.print_usage(sys.stderr)
        self.exit(64, f"{self.prog}: {message}\n")


def plot_folder(draw, description, folder):
    """Calls draw with the folder that the command line names and prints what it returns. Returns the exit code."""
    parser = Parser(description=description)
    parser.add_argument("directory", metavar="DIR", type=pathlib.Path, help=folder)
    arguments = parser.parse_args()
    try:
        print(draw(arguments.directory))
    except (OSError, ValueError) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    return 0
