"""Errors of the measurement, on simulated and on real scans of known volume."""

from divespot.evaluate.evaluation import Evaluation, evaluate
from divespot.evaluate.goals import Goal, goals
from divespot.evaluate.known import read_list
from divespot.evaluate.outcome import Extra, Outcome, PileOutcome
from divespot.evaluate.rounds import run_rounds
from divespot.evaluate.statistics import ErrorStatistics, Summary

__all__ = [
    "ErrorStatistics",
    "Evaluation",
    "Extra",
    "Goal",
    "Outcome",
    "PileOutcome",
    "Summary",
    "evaluate",
    "goals",
    "read_list",
    "run_rounds",
]
