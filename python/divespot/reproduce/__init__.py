"""The paper's evaluation, reproduced on simulated scans of known volume."""

from divespot.reproduce.plan import Plan
from divespot.reproduce.reproduction import EXPERIMENTS, reproduce

__all__ = ["EXPERIMENTS", "Plan", "reproduce"]
