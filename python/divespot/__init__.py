"""The volume of each pile in a point cloud, with its uncertainty."""

from divespot.errors import DivespotError

__all__ = ["DivespotError"]
