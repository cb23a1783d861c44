"""The report as users have it: with its ways out, each imported where it is used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from divespot import report
from divespot.results import comparison

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure


class Report(report.Report):
    """The result of `divespot.measure`: its fields (see `divespot.report`), and its ways out."""

    def __repr__(self) -> str:
        from divespot.results.telling import told  # noqa: PLC0415 - slow to import

        return told(self)

    def _repr_html_(self) -> str:
        """Return a picture and a table, for notebooks."""
        from divespot.results.notebook import html  # noqa: PLC0415 - as above

        return html(self)

    @staticmethod
    def from_json(text: str | bytes) -> Report:
        """Return the report that `to_json`, or a line of JSON Lines, holds.

        It is equal to the one that was written, but holds no levelled scene: no picture can be
        drawn of it.

        Raises
        ------
        DivespotError
            It is no report of this version's schema.

        """
        from divespot.results.parsed import parsed  # noqa: PLC0415 - as above

        return parsed(text, Report)

    def to_dataframe(self) -> Any:  # noqa: ANN401 - of pandas or polars, which may be absent
        """Return a row for each pile and each other object: pandas, or polars where that is absent.

        Raises
        ------
        DivespotError
            Neither is installed.

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
        """Write the report; the ending of the path says as what.

        Parameters
        ----------
        path
            ``.json``, ``.csv``, ``.geojson``, ``.gpkg``, ``.las``, ``.laz``; ``.tif`` for heights;
            ``.ply`` for meshes; ``.html`` or ``.pdf`` for a page to be read and signed; ``.png`` or
            ``.svg`` for the plan.
        force
            Overwrite a file that divespot did not write.

        Raises
        ------
        DivespotError
            Another ending, an extra that is not installed, or a file that is not to be overwritten.

        """
        from divespot.results.saving import save  # noqa: PLC0415 - as above

        save(self, path, force=force)


class Comparison(comparison.Comparison):
    """The result of `divespot.compare`: `divespot.results.comparison`, and its ways out."""

    def __repr__(self) -> str:
        from divespot.results.change_document import told  # noqa: PLC0415 - slow to import

        return told(self)

    def plot(self) -> Figure:
        """Draw the plan of what came and went.

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
        """Write the comparison; the ending of the path says as what.

        Parameters
        ----------
        path
            ``.json``; ``.geojson`` or ``.gpkg`` for the places' outlines; ``.tif`` for both
            surfaces and their difference; ``.html`` or ``.pdf`` for a page to be read and signed;
            ``.png`` or ``.svg`` for the plan.
        site
            What the place is called, for the page.
        force
            Overwrite a file that divespot did not write.

        Raises
        ------
        DivespotError
            Another ending, an extra that is not installed, or a file that is not to be overwritten.

        """
        from divespot.results.change_report import save_change  # noqa: PLC0415 - as above

        save_change(self, path, site=site, force=force)
