"""The report as users have it, with its methods, whose modules are imported on use."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from divespot import report
from divespot.results import comparison

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure


class Report(report.Report):
    """The result of `divespot.measure`: its fields (see `divespot.report`), and its methods."""

    def __repr__(self) -> str:
        from divespot.results.telling import told  # noqa: PLC0415 - slow to import

        return told(self)

    def _repr_html_(self) -> str:
        """Return a picture and a table, for notebooks."""
        from divespot.results.notebook import html  # noqa: PLC0415 - as above

        return html(self)

    @staticmethod
    def from_json(text: str | bytes) -> Report:
        """Return the report from the text of `to_json`, or from a line of JSON Lines.

        It equals the report that was written, but has no levelled scene, so that no picture can
        be drawn.

        Raises
        ------
        DivespotError
            The text is not a report of this version's schema.

        """
        from divespot.results.parsed import parsed  # noqa: PLC0415 - as above

        return parsed(text, Report)

    def to_dataframe(self) -> Any:  # noqa: ANN401 - of pandas or polars, which may be absent
        """Return a row for each pile and each other object: pandas, or polars if that is missing.

        Raises
        ------
        DivespotError
            Neither pandas nor polars is installed.

        """
        from divespot.results.frames import dataframe  # noqa: PLC0415 - as above

        return dataframe(self)

    def plot(self) -> Figure:
        """Draw the plan with the piles (see `divespot.plot.figure`).

        Raises
        ------
        DivespotError
            matplotlib is not installed, or the report is from JSON.

        """
        from divespot.plot import figure  # noqa: PLC0415 - as above

        return figure(self)

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the report in the format given by the path's ending.

        Parameters
        ----------
        path
            ``.json``, ``.csv``, ``.geojson``, ``.gpkg``, ``.las``, ``.laz``; ``.tif`` for heights;
            ``.ply`` for meshes; ``.html`` or ``.pdf`` for a page to read and sign; ``.png`` or
            ``.svg`` for the plan.
        force
            Overwrite a file that divespot did not write.

        Raises
        ------
        DivespotError
            The ending is unknown, an extra is missing, or the file must not be overwritten.

        """
        from divespot.results.saving import save  # noqa: PLC0415 - as above

        save(self, path, force=force)


class Comparison(comparison.Comparison):
    """The result of `divespot.compare`: `divespot.results.comparison`, with its methods."""

    def __repr__(self) -> str:
        from divespot.results.change_document import told  # noqa: PLC0415 - slow to import

        return told(self)

    def plot(self) -> Figure:
        """Draw the plan of gains and losses.

        Raises
        ------
        DivespotError
            matplotlib is not installed.

        """
        from divespot.results.change_report import change_figure  # noqa: PLC0415 - as above

        return change_figure(self)

    def save(
        self, path: str | os.PathLike[str], *, site: str | None = None, force: bool = False
    ) -> None:
        """Write the comparison in the format given by the path's ending.

        Parameters
        ----------
        path
            ``.json``; ``.geojson`` or ``.gpkg`` for the places' outlines; ``.tif`` for both
            surfaces and their difference; ``.html`` or ``.pdf`` for a page to read and sign;
            ``.png`` or ``.svg`` for the plan.
        site
            Name of the site, for the page.
        force
            Overwrite a file that divespot did not write.

        Raises
        ------
        DivespotError
            The ending is unknown, an extra is missing, or the file must not be overwritten.

        """
        from divespot.results.change_report import save_change  # noqa: PLC0415 - as above

        save_change(self, path, site=site, force=force)
