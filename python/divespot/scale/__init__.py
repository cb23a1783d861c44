"""Scans of any size: added up in one pass, in bounded memory, by one machine or many."""

from divespot.accumulator import Accumulator, Held

__all__ = ["Accumulator", "Held"]
