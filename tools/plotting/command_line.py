"""Command lines of our Python scripts: a wrong one ends with exit code 64, as that of every program does."""
import argparse
import sys


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.print_usage(sys.stderr)
        self.exit(64, f"{self.prog}: {message}\n")
