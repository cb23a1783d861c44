"""The page's HTML, made from its Markdown."""

from __future__ import annotations

from string import Template

from divespot.extras import extra

FRAME = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #22303c;
  font: 16px/1.5 system-ui, sans-serif; }
table { border-collapse: collapse; font-size: 0.9rem; display: block; overflow-x: auto; }
th, td { padding: 0.2rem 0.7rem; border-bottom: 1px solid #d5dbe0; white-space: nowrap; }
img { max-width: 100%; }
h1, h2 { line-height: 1.2; }
h2 { margin-top: 2.5rem; border-top: 2px solid #00667a; padding-top: 0.6rem; }
</style>
</head>
<body>
$body</body>
</html>
""")


def html(title: str, markdown: str) -> str:
    """Return a self-contained page.

    Raises
    ------
    DivespotError
        markdown-it-py is not installed.

    """
    markdown_it = extra("markdown_it", "reproduce", "the page needs markdown-it-py")
    body = markdown_it.MarkdownIt("commonmark").enable("table").render(markdown)
    return FRAME.substitute(title=title, body=body)
