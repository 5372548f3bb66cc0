"""Plots and report of one run."""
