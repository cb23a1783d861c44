"""The structure of the page, and its Markdown."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from divespot.reproduce.charts import Chart


@dataclass(frozen=True)
class Table:
    """A header and rows of text; the first column is a name, the others are numbers."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """Return the table in GitHub's Markdown."""
        ruler = [":--", *["--:"] * (len(self.header) - 1)]
        return "\n".join(f"| {' | '.join(row)} |" for row in (self.header, ruler, *self.rows))


@dataclass(frozen=True)
class Picture:
    """A chart, and its file name."""

    name: str
    caption: str
    chart: Chart

    @property
    def path(self) -> str:
        """Path relative to the page."""
        return f"figures/{self.name}.png"

    def markdown(self) -> str:
        """Return the link."""
        return f"![{self.caption}]({self.path})\n\n*{self.caption}*"


@dataclass(frozen=True)
class Finding:
    """A claim of the paper or a goal, whether it holds here, and the figures."""

    claim: str
    holds: bool
    figures: str
    why_not: str = ""

    def markdown(self) -> str:
        """Return the finding as one sentence."""
        if self.holds:
            return f"**Holds:** {self.claim} ({self.figures})."
        reason = f" {self.why_not}" if self.why_not else ""
        return f"**Does not hold:** {self.claim} ({self.figures}).{reason}"


@dataclass(frozen=True)
class Section:
    """A section of the page, and the JSON behind it."""

    title: str
    blocks: Sequence[str | Table | Picture]
    data: dict[str, Any]
    findings: Sequence[Finding] = field(default=())

    def markdown(self) -> str:
        """Return the section."""
        blocks = [b if isinstance(b, str) else b.markdown() for b in self.blocks]
        told = "\n".join(f"- {finding.markdown()}" for finding in self.findings)
        return _joined([f"## {self.title}", *blocks, told])

    def pictures(self) -> list[Picture]:
        """Return its pictures."""
        return [block for block in self.blocks if isinstance(block, Picture)]


def page(title: str, introduction: str, sections: Sequence[Section]) -> str:
    """Return the page: introduction, all findings, the sections."""
    count = [finding.holds for section in sections for finding in section.findings]
    told = f"Of {len(count)} findings and goals, {sum(count)} hold here."
    missed = [
        f"- {section.title}: {finding.markdown()}"
        for section in sections
        for finding in section.findings
        if not finding.holds
    ]
    parts = (section.markdown() for section in sections)
    return _joined([f"# {title}", introduction, told, "\n".join(missed), *parts]) + "\n"


def _joined(parts: Iterable[str]) -> str:
    return "\n\n".join(part for part in parts if part)


def percent(share: float | None) -> str:
    """Return a share in percent, with one or two decimals."""
    if share is None:
        return "-"
    return f"{100 * share:.{2 if abs(share) < 0.1 else 1}f} %"


def cubic(volume_m3: float | None) -> str:
    """Return a volume in cubic metres, as the paper prints it."""
    return "-" if volume_m3 is None else f"{volume_m3:.5f}"


def counted(number: int, thing: str) -> str:
    """Return a number of things as text: one scan, 3 scans."""
    return f"one {thing}" if number == 1 else f"{number} {thing}s"
