"""Output of results: tables, outlines, reports, pictures, history, comparisons."""
