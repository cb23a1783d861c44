"""Scans of any size: added up in one pass, in bounded memory, by one machine or many."""

from divespot.accumulator import Accumulator, Held
from divespot.scale.cluster import measure

__all__ = ["Accumulator", "Held", "measure"]
